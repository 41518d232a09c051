"""Which point of a robot stands for which landmark of a person: a small YAML file beside the robot's MJCF."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from bumblebee.errors import BadInput
from bumblebee.io.read import parse_yaml, read_text
from bumblebee.motion.retarget.tree import Tree, points, poses, tree_of
from bumblebee.robot.facts import BODY_OF, joints, stand_pose
from bumblebee.robot.folder import chosen
from bumblebee.robot.model import RobotConfig, build_model
from bumblebee.robot.written import SIDES, Vector

LIMBS = ("hip", "knee", "ankle", "shoulder", "elbow", "wrist")
POINTS = (*(f"{side}_{limb}" for side in SIDES for limb in LIMBS), "neck")
"""Landmarks that a mapping places on the robot, in the order of `Robot.body`."""
CORNERS = 4
_KEYS = ("robot", "points", "soles", "sole_radius", "joint_speed", "rest")
_JOINT_SPEED = 20.0  # rad/s, where a mapping states none: what the slower of the G1's motors reach
_SPEEDS = (0.01, 1000.0)  # rad/s
_ANGLES = (-2 * np.pi, 2 * np.pi)  # rad
_FARTHEST = 10.0  # m of a point in its body's frame
_SHORTEST = 0.01  # m of a limb or a sole
_LONGEST_NAME = 100
_LIMBS = (("hip", "knee"), ("knee", "ankle"), ("shoulder", "elbow"), ("elbow", "wrist"))


@dataclass(frozen=True, eq=False)
class Robot:
    """A robot that motions are retargeted to.

    `body` (13,) and `local` (13, 3) [m]: where `POINTS` lie; `sole_body` (8,) and `sole` (8, 3) [m]: the corners of
    both soles, left foot first, each heel left, heel right, toe left, toe right; `fastest` (n,) [rad/s]; `rest` (n,)
    [rad]: the angles that joints keep where the person says nothing about them.
    """

    name: str
    model: mujoco.MjModel
    tree: Tree
    body: np.ndarray
    local: np.ndarray
    sole_body: np.ndarray
    sole: np.ndarray
    radius: float
    """Radius of the spheres at the soles' corners [m]."""
    fastest: np.ndarray
    rest: np.ndarray


@cache
def this_robot() -> Robot:
    """The robot of this process, with what its folder holds still locked."""
    model = build_model(RobotConfig(feet="capsules"))
    speeds = np.array([joint.velocity_limit for joint in joints()])
    return make_robot("robot.yaml", own_mapping(), model, speeds, stand_pose())


def own_mapping() -> dict[str, Any]:
    """The mapping that a robot's folder says: a limb's key bodies and the corners that reach the floor."""
    said = chosen().written
    ends = {"ankle": "foot", "wrist": "hand"}
    bodies = {f"{side}_{limb}": BODY_OF[f"{side}_{ends.get(limb, limb)}"] for side in SIDES for limb in LIMBS}
    soles = {
        side: [
            BODY_OF[f"{side}_foot"],
            [list(corner) for corner in _heel_first(said.reach.get(side, said.soles[side]))],
        ]
        for side in SIDES
    }
    neck = [said.neck[0], list(said.neck[1])]
    return {"robot": said.robot, "points": {**bodies, "neck": neck}, "soles": soles, "sole_radius": said.sole_radius}


def _heel_first(corners: Sequence[Vector]) -> list[Vector]:
    """Corners of a sole as heel left, heel right, toe left, toe right."""
    along = sorted(corners)
    return [corner for pair in (along[:2], along[2:]) for corner in sorted(pair, key=lambda one: -one[1])]


def read_robot(model: Path, mapping: Path) -> Robot:
    """Any humanoid, from its MJCF and its mapping.

    Raises:
        BadInput: a model that MuJoCo does not load, a mapping that names what the model does not have.
    """
    try:
        loaded = mujoco.MjModel.from_xml_path(str(model))
    except (ValueError, mujoco.FatalError) as error:
        raise BadInput(model, "an MJCF that MuJoCo loads", " ".join(str(error).split())[:200]) from None
    tree_of(loaded, model)
    return make_robot(mapping, parse_yaml(mapping, read_text(mapping)), loaded)


def make_robot(
    where: object,
    mapping: Any,
    model: mujoco.MjModel,
    fastest: np.ndarray | None = None,
    rest: np.ndarray | None = None,
) -> Robot:
    """A robot from a mapping that has been read, and its model.

    Args:
        where: the mapping's place in a message.
        mapping: `points` and `soles`, and `robot`, `sole_radius` [m], `joint_speed` [rad/s], `rest` [rad] if wanted.
        model: with a free joint on its first body and hinges.
        fastest: highest speeds of the joints (n,) [rad/s] instead of `joint_speed`.
        rest: angles (n,) [rad] instead of `rest`.
    """
    if not isinstance(mapping, Mapping) or set(mapping) - set(_KEYS) or {"points", "soles"} - set(mapping):
        came = ", ".join(map(str, mapping))[:80] if isinstance(mapping, Mapping) else f"a {type(mapping).__name__}"
        raise BadInput(where, f"a mapping with {', '.join(_KEYS)}", came)
    tree = tree_of(model)
    placed = _table(f"{where}: points", mapping["points"], POINTS)
    places = [_point(f"{where}: points.{name}", placed[name], tree) for name in POINTS]
    soles = _table(f"{where}: soles", mapping["soles"], SIDES)
    corners = [corner for side in SIDES for corner in _sole(f"{where}: soles.{side}", soles[side], tree)]
    if fastest is None:
        speeds = mapping.get("joint_speed", _JOINT_SPEED)
        fastest = _by_joint(f"{where}: joint_speed", speeds, tree, np.full(len(tree.joints), _JOINT_SPEED), _SPEEDS)
    if rest is None:
        rest = _by_joint(f"{where}: rest", mapping.get("rest", {}), tree, np.zeros(len(tree.joints)), _ANGLES)
        rest = np.clip(rest, tree.low, tree.high)
    robot = Robot(
        _name(f"{where}: robot", mapping.get("robot", model.names[: model.names.index(b"\0")].decode() or "robot")),
        model,
        tree,
        np.array([body for body, _ in places]),
        np.array([local for _, local in places]),
        np.array([body for body, _ in corners]),
        np.array([local for _, local in corners]),
        _radius(f"{where}: sole_radius", mapping.get("sole_radius", 0.0)),
        fastest,
        rest,
    )
    _require_body(where, robot)
    return robot


def _require_body(where: object, robot: Robot) -> None:
    """Refuse limbs and soles without length: the points of a mapping are then not where they should be."""
    at = poses(robot.tree, np.zeros((1, 3)), np.eye(3)[None], robot.rest[None])
    spots = dict(zip(POINTS, points(at, robot.body, robot.local)[0], strict=True))
    chains = [(f"{side}_{a}", f"{side}_{b}") for side in SIDES for a, b in _LIMBS]
    for a, b in (*chains, ("left_hip", "right_hip"), ("left_shoulder", "right_shoulder"), ("left_hip", "neck")):
        if np.linalg.norm(spots[a] - spots[b]) < _SHORTEST:
            raise BadInput(f"{where}: points", f"{a} and {b} apart", "the same place")
    for number, side in enumerate(SIDES):
        corners = robot.sole[number * CORNERS : (number + 1) * CORNERS]
        if np.linalg.norm(corners[2:].mean(axis=0) - corners[:2].mean(axis=0)) < _SHORTEST:
            raise BadInput(f"{where}: soles.{side}", "heel and toe apart", "the same place")
    if not robot.tree.moves[robot.sole_body].any(axis=1).all():
        raise BadInput(f"{where}: soles", "bodies below a joint", "one that no joint moves")


def _name(where: str, value: Any) -> str:
    if not isinstance(value, str) or not value.strip() or len(value) > _LONGEST_NAME:
        raise BadInput(where, f"a name of at most {_LONGEST_NAME} signs", repr(value)[:60])
    return value


def _table(where: str, value: Any, names: tuple[str, ...]) -> Mapping[str, Any]:
    missing = [name for name in names if not isinstance(value, Mapping) or name not in value]
    unknown = [str(name) for name in value if name not in names] if isinstance(value, Mapping) else []
    if missing or unknown:
        raise BadInput(where, ", ".join(names), f"none for {missing[0]}" if missing else f"unknown {unknown[0][:40]!r}")
    return value


def _point(where: str, value: Any, tree: Tree) -> tuple[int, np.ndarray]:
    """Body and place of `name` or `[name, [x, y, z]]`."""
    name, local = value if isinstance(value, list) and len(value) == 2 else (value, [0.0, 0.0, 0.0])
    if name not in tree.bodies:
        raise BadInput(where, "a body of the model", repr(name)[:60], f"Bodies: {', '.join(tree.bodies)}"[:300])
    return tree.bodies.index(name), _vector(where, local)


def _sole(where: str, value: Any, tree: Tree) -> list[tuple[int, np.ndarray]]:
    if not isinstance(value, list) or len(value) != 2 or not isinstance(value[1], list) or len(value[1]) != CORNERS:
        wanted = "[body, [heel left, heel right, toe left, toe right]], each corner [x, y, z]"
        raise BadInput(where, wanted, repr(value)[:80])
    return [_point(where, [value[0], corner], tree) for corner in value[1]]


def _radius(where: str, value: Any) -> float:
    if not _number(value, (0.0, 0.5)):
        raise BadInput(where, "a radius from 0 to 0.5 m", repr(value)[:40])
    return float(value)


def _vector(where: str, value: Any) -> np.ndarray:
    if not isinstance(value, list) or len(value) != 3 or not all(_number(x, (-_FARTHEST, _FARTHEST)) for x in value):
        raise BadInput(where, f"three numbers from -{_FARTHEST:g} to {_FARTHEST:g} [m]", repr(value)[:60])
    return np.array(value, float)


def _number(value: Any, within: tuple[float, float]) -> bool:
    """Whether it is a number within bounds; NaN and infinities are not."""
    return isinstance(value, int | float) and not isinstance(value, bool) and within[0] <= value <= within[1]


def _by_joint(where: str, value: Any, tree: Tree, default: np.ndarray, within: tuple[float, float]) -> np.ndarray:
    """One number a joint: a number for all, or a table whose names may leave out left_ and right_ and _joint."""
    result = default.copy()
    said = f"a number from {within[0]:g} to {within[1]:g}"
    if not isinstance(value, Mapping):
        if not _number(value, within):
            raise BadInput(where, f"{said}, or a table of joints", repr(value)[:40])
        return np.full(len(tree.joints), float(value))
    for name, number in value.items():
        if not _number(number, within):
            raise BadInput(f"{where}.{name}"[:200], said, repr(number)[:40])
        hit = [j for j, joint in enumerate(tree.joints) if name in (joint, _plain(joint))]
        if not hit:
            raise BadInput(where, f"joints of the model: {', '.join(tree.joints)}"[:300], repr(name)[:60])
        result[hit] = number
    return result


def _plain(joint: str) -> str:
    return joint.removesuffix("_joint").removeprefix("left_").removeprefix("right_")
