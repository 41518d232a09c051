"""A first robot.yaml of an MJCF: what geometry and names tell, and what a person must look at.

Legs are the two chains of joints whose ends are lowest, arms the two that end farthest to the sides above the pelvis;
knees and elbows are found by their joints' names, else as the joint that bends farthest from both ends of its limb; a
hand is the last body that is fixed to an arm; a sole is the lowest of a foot's shapes, else the box of its mass and
inertia. Everything is inferred at the model's zero pose, but for the stand, which a keyframe of the maker's may tell.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from bumblebee import quaternions
from bumblebee.errors import BadInput
from bumblebee.new_robot.maker import CORNERS, Maker
from bumblebee.robot.mjcf import half_lengths
from bumblebee.robot.shapes import Bodies
from bumblebee.robot.written import EVERY, SIDES

_SOLE = 0.01  # m: radius of the spheres at a sole's corners
_BENT = {"hip": -0.1, "knee": 0.3, "ankle": -0.2}  # rad: a relaxed stand, turns about y
_GUESS = {"velocity_limit": 20.0}  # rad/s: what most motors of humanoids reach
_FORWARD = 1.8  # times the centre of mass: the end of a last link, as of an even rod and a bit
_ACROSS = 0.9  # of an axis along y: a joint that pitches; of one along its limb: a joint that twists
_APART = 0.05  # m between two key bodies of a limb


@dataclass(frozen=True)
class Draft:
    """Content of a robot.yaml, and questions to the person who knows the robot."""

    said: dict[str, Any]
    asked: tuple[str, ...]


def draft(where: object, name: str, model: str, bodies: Bodies, maker: Maker) -> Draft:
    """Infer a robot's file.

    Args:
        where: the model, for messages.
        name: the robot's.
        model: name of the MJCF beside the file.
        bodies: its table (`mjcf.bodies_of`).
        maker: what else its model says.

    Raises:
        BadInput: no two legs or no two arms are found.
    """
    at = poses_of(bodies)
    chains = [_chain(bodies, body) for body in bodies if _is_end(bodies, body)]
    legs = _pair(where, "legs", chains, at, lambda end: end[2])
    arms = _pair(where, "arms", [c for c in chains if c not in legs.values()], at, lambda end: -abs(end[1]))
    torso = _shared(list(arms.values()))
    pelvis = next(iter(bodies))
    roles: dict[str, Any] = {"pelvis": pelvis}
    for side in SIDES:
        own = _limb(legs[side], torso, pelvis)
        knee = _middle(bodies, own, at, at[own[-1]][0], "knee")
        roles |= {f"{side}_hip": _before(own, knee), f"{side}_knee": knee, f"{side}_foot": own[-1]}
    roles["torso"] = torso
    for side in SIDES:
        own = _limb(arms[side], torso, pelvis)
        tip = _tip(bodies, own[-1], at)
        end = _turned(at, own[-1], _end_of(bodies, own[-1])) + at[own[-1]][0] if tip == own[-1] else at[tip][0]
        elbow = _middle(bodies, own, at, end, "elbow")
        near = np.linalg.norm(at[elbow][0] - at[tip][0]) < _APART
        hand: Any = [own[-1], _numbers(_seen(at, own[-1], end))] if near else tip
        roles |= {f"{side}_shoulder": _before(own, elbow), f"{side}_elbow": elbow, f"{side}_hand": hand}
    shoulders = np.mean([at[roles[f"{side}_shoulder"]][0] for side in SIDES], axis=0)
    rise = shoulders[2] - at[roles["left_hip"]][0][2]
    if torso == pelvis:  # a waist between the trunk and the legs
        roles["torso"] = [torso, _numbers(_seen(at, torso, (at[torso][0] + shoulders) / 2))]
    said = {
        "robot": name,
        "model": model,
        "held": [],
        "motors": _motors(bodies),
        "stand": _kept(bodies, maker.stand) or _stand(bodies, roles, at),
        "key_bodies": roles,
        "head": [torso, _numbers(_seen(at, torso, shoulders + np.array([0, 0, 0.45 * rise])))],
        "neck": [torso, _numbers(_seen(at, torso, shoulders + np.array([0, 0, 0.1 * rise])))],
        "sole_radius": _SOLE,
        "soles": {side: _sole(bodies, roles[f"{side}_foot"], at, maker) for side in SIDES},
    }
    return Draft(said, tuple(_questions(said, bodies)))


def poses_of(bodies: Bodies, angles: Mapping[str, float] | None = None) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Place [m] and orientation of each body from the root, at these joint angles [rad]; what is not named is at 0."""
    angles = angles or {}
    found: dict[str, tuple[np.ndarray, np.ndarray]] = {}
    for name, facts in bodies.items():
        if facts["parent"] not in found:
            found[name] = np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0])
            continue
        place, turn = found[facts["parent"]]
        own = quaternions.multiply(turn, quaternions.normalised(np.array(facts["quat"])))
        if joint := facts.get("joint"):
            bent = quaternions.from_axis_angle(joint["axis"], angles.get(joint["name"], 0.0))
            own = quaternions.multiply(own, bent)
        found[name] = place + quaternions.rotate(turn, np.array(facts["pos"])), own
    return found


def _is_end(bodies: Bodies, body: str) -> bool:
    """Whether no joint hangs on a body that a joint moves."""
    return "joint" in bodies[body] and not any("joint" in f and body in _above(bodies, n) for n, f in bodies.items())


def _above(bodies: Bodies, body: str) -> list[str]:
    found = []
    while (body := bodies[body]["parent"]) != "world":
        found.append(body)
    return found


def _chain(bodies: Bodies, end: str) -> tuple[str, ...]:
    """Bodies with joints from the root to an end; the root first."""
    path = [end, *_above(bodies, end)][::-1]
    return tuple(body for body in path if body == path[0] or "joint" in bodies[body])


def _pair(where: object, what: str, chains: Sequence[tuple[str, ...]], at: Mapping[str, Any], rank: Any) -> dict:
    """The lowest-ranking chain on each side, left where y is positive."""
    found = {}
    for side, sign in zip(SIDES, (1, -1), strict=True):
        own = [chain for chain in chains if sign * at[chain[-1]][0][1] > 0.02 and len(chain) > 3]
        if not own:
            raise BadInput(
                where, f"two {what}: chains of joints to the left (+y) and right of the base", f"none {side}"
            )
        found[side] = min(own, key=lambda chain: rank(at[chain[-1]][0]))
    return found


def _shared(chains: Sequence[tuple[str, ...]]) -> str:
    """The last body that two chains share."""
    return [one for one, other in zip(*chains, strict=False) if one == other][-1]


def _limb(chain: tuple[str, ...], torso: str, pelvis: str) -> tuple[str, ...]:
    """The part of a chain that lies beyond the trunk."""
    start = max(chain.index(body) for body in (torso, pelvis) if body in chain)
    return chain[start + 1 :]


def _middle(bodies: Bodies, own: Sequence[str], at: Mapping[str, Any], end: np.ndarray, word: str) -> str:
    """The body of a limb's middle: by its joint's name, else whose joint bends farthest from the limb's both ends."""

    def bends(body: str) -> bool:
        along, axis = end - at[body][0], _turned(at, body, np.array(bodies[body]["joint"]["axis"]))
        return abs(float(axis @ along)) < _ACROSS * float(np.linalg.norm(along))

    bent = [body for body in own if bends(body)] or list(own)
    named = [body for body in bent if word in bodies[body]["joint"]["name"].lower()]
    first = at[own[0]][0]
    return max(named or bent, key=lambda b: min(np.linalg.norm(at[b][0] - first), np.linalg.norm(at[b][0] - end)))


def _tip(bodies: Bodies, last: str, at: Mapping[str, Any]) -> str:
    """The body that ends a limb: of those fixed to its last moving one, the farthest from its joint."""
    fixed = [body for body in bodies if last in [body, *_above(bodies, body)] and _moved_by(bodies, body) == last]
    far = max(fixed, key=lambda body: np.linalg.norm(at[body][0] - at[last][0]))
    return far if np.linalg.norm(at[far][0] - at[last][0]) > _APART else last


def _moved_by(bodies: Bodies, body: str) -> str:
    """The next body up, itself included, that has a joint."""
    return next((one for one in [body, *_above(bodies, body)] if "joint" in bodies[one]), body)


def _before(own: Sequence[str], body: str) -> str:
    """The second of a limb's bodies, or the first where its middle comes second."""
    return own[min(1, max(0, list(own).index(body) - 1))]


def _turned(at: Mapping[str, Any], body: str, place: np.ndarray) -> np.ndarray:
    return quaternions.rotate(at[body][1], place)


def _seen(at: Mapping[str, Any], body: str, place: np.ndarray) -> np.ndarray:
    """A place in a body's own frame."""
    return quaternions.rotate(quaternions.conjugate(at[body][1]), place - at[body][0])


def _end_of(bodies: Bodies, body: str) -> np.ndarray:
    """The far end of a limb's last link in its frame [m]."""
    return _FORWARD * np.array(bodies[body]["com"])


def _motors(bodies: Bodies) -> dict[str, dict[str, float | None]]:
    """Motors' facts that the model does not tell: a guess, else None for a person to fill."""
    wanted = ("effort_limit", "velocity_limit", "armature")
    joints = [facts["joint"] for facts in bodies.values() if "joint" in facts]
    found: dict[str, dict[str, float | None]] = {}
    for key in wanted:
        lacking = [joint["name"] for joint in joints if key not in joint]
        for name in [EVERY] if len(lacking) == len(joints) else lacking:
            found.setdefault(name, {})[key] = _GUESS.get(key)
    return found


def _kept(bodies: Bodies, angles: Mapping[str, float]) -> dict[str, float]:
    """A keyframe's angles, but for joints that are at 0 in it."""
    ranges = {facts["joint"]["name"]: facts["joint"]["range"] for facts in bodies.values() if "joint" in facts}
    return {name: round(float(np.clip(a, *ranges[name])), 4) for name, a in angles.items() if name in ranges and a}


def _stand(bodies: Bodies, roles: Mapping[str, Any], at: Mapping[str, Any]) -> dict[str, float]:
    """Bent knees under a level trunk, by the joints of the legs that pitch."""
    found = {}
    for side in SIDES:
        path = [
            b for b in [roles[f"{side}_foot"], *_above(bodies, roles[f"{side}_foot"])][::-1] if "joint" in bodies[b]
        ]
        knee = path.index(roles[f"{side}_knee"])
        for number, body in enumerate(path):
            joint = bodies[body]["joint"]
            axis = _turned(at, body, np.array(joint["axis"]))
            if abs(axis[1]) < _ACROSS or body in _above(bodies, roles["left_elbow"]):
                continue
            part = "hip" if number < knee else "knee" if number == knee else "ankle"
            low, high = joint["range"]
            found[joint["name"]] = float(np.clip(np.sign(axis[1]) * _BENT[part], low, high))
    return found


def _sole(bodies: Bodies, foot: str, at: Mapping[str, Any], maker: Maker) -> list[list[float]]:
    """Four corners under a foot, as centres of spheres: of its lowest shapes, else of the box of its inertia."""
    boxes = maker.boxes.get(foot, [])
    if not boxes:
        half = half_lengths(bodies[foot]["mass"], np.array(bodies[foot]["inertia"]))
        turn = quaternions.normalised(np.array(bodies[foot]["inertia_quat"]))
        boxes = [np.array([quaternions.rotate(turn, c) for c in half * CORNERS]) + bodies[foot]["com"]]
    placed = [np.array([_turned(at, foot, corner) for corner in box]) for box in boxes]  # a foot's frame may be tilted
    bottom = min(box[:, 2].min() for box in placed)
    touching = np.concatenate([box for box in placed if box[:, 2].min() < bottom + _SOLE])
    low, high = touching.min(axis=0), touching.max(axis=0)
    inset = np.minimum(_SOLE, 0.25 * (high - low))
    xs, ys = (low[0] + inset[0], high[0] - inset[0]), (low[1] + inset[1], high[1] - inset[1])
    back = quaternions.conjugate(at[foot][1])
    return [_numbers(quaternions.rotate(back, np.array([x, y, bottom + _SOLE]))) for x in xs for y in ys]


def ends_of(shape: Mapping[str, Any]) -> list[np.ndarray]:
    """The centre of a sphere, or both ends of a capsule's axis, (3,) [m] in the body's frame."""
    centre = np.array(shape["pos"])
    if shape["type"] == "sphere":
        return [centre]
    reach = quaternions.rotate(np.array(shape["quat"]), np.array([0.0, 0.0, shape["size"][1]]))
    return [centre - reach, centre + reach]


def _questions(said: Mapping[str, Any], bodies: Bodies) -> list[str]:
    """Questions to the person who knows the robot, the surest trouble first."""
    lacking = {key for lacks in said["motors"].values() for key, value in lacks.items() if value is None}
    guessed = {key: value for lacks in said["motors"].values() for key, value in lacks.items() if value is not None}
    points = [role for role, value in said["key_bodies"].items() if isinstance(value, list)]
    driven = [facts["joint"] for facts in bodies.values() if "joint" in facts]
    return [
        *(f"motors: {key}, which the model does not say; without it nothing runs" for key in sorted(lacking)),
        *(f"motors: {key} is a guess of {value:g}" for key, value in guessed.items()),
        *(
            ["motors: kp and kd, where the robot's own servos have others than 10 Hz on their rotors"]
            if any("kp" not in joint for joint in driven)
            else []
        ),
        "soles: their corners are guessed from the foot's shapes or inertia; measure them",
        "head, neck: guessed above the shoulders",
        *([f"key_bodies: {', '.join(points)} guessed, as a point of a link"] if points else []),
        "held: joints that stay still, such as wrists or a neck",
    ]


def _numbers(values: np.ndarray) -> list[float]:
    return [round(float(value), 4) for value in values]
