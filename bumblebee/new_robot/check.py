"""Whether a robot's folder describes a robot that can be trained: each check with what it found."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import mujoco
import numpy as np

from bumblebee.errors import BadInput
from bumblebee.robot.facts import BODY_OF, FEET, PELVIS, SOLE_RADIUS, SOLES, joints, limb, stand_pose
from bumblebee.robot.mirror import mirrored_joints
from bumblebee.robot.model import RobotConfig, build_model, gains
from bumblebee.robot.written import SIDES

FLAT = 0.01  # m between the highest and the lowest corner of both soles
UPRIGHT = np.cos(np.deg2rad(10))
ALIKE = 0.02  # of a range or a limit: what makers' two sides differ by
KILOGRAMS, HEIGHT = (3.0, 300.0), (0.2, 2.5)  # kg, m of the pelvis
EFFORT, SPEED, FREQUENCY, DAMPING = (0.5, 2000.0), (0.5, 100.0), (0.5, 40.0), (0.05, np.inf)  # N m, rad/s, Hz, 1
SAG = 0.5  # rad that a servo may give way under the robot's own weight


@dataclass(frozen=True)
class Finding:
    """One check: what it asks, whether it holds, what was found."""

    name: str
    holds: bool
    found: str


def check() -> list[Finding]:
    """All checks of this process's robot, each by itself: one that fails hides no other."""
    model = build_model()
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    every: tuple[tuple[str, Callable[[], Iterator[str]]], ...] = (
        ("size: mass and height of a humanoid in kg and m", lambda: _size(model, data)),
        ("limbs: joints in both legs and both arms, left ones at +y", lambda: _limbs(data)),
        ("sides: each joint has a partner in the mirror, with the same limits and motor", _sides),
        ("motors: torques, speeds and servos of a robot in N m, rad/s and kg m^2", _motors),
        ("stand: within the joints' ranges, trunk upright", lambda: _stand(data)),
        ("soles: flat on the floor, nothing lower", lambda: _soles(model, data)),
        ("balance: the centre of mass over the soles", lambda: _balance(data)),
        ("strength: motors and servos hold the stand", lambda: _strength(model, data)),
        ("shapes: no two links inside each other as it stands", _shapes),
    )
    return [_tried(name, problems) for name, problems in every]


def _tried(name: str, problems: Callable[[], Iterator[str]]) -> Finding:
    try:
        found = list(problems())
    except BadInput as error:
        found = [f"{error.where}: expected {error.expected}, came {error.came}"]
    more = f" (and {len(found) - 3} more)" if len(found) > 3 else ""
    return Finding(name, not found, "; ".join(found[:3]) + more)


def _size(model: mujoco.MjModel, data: mujoco.MjData) -> Iterator[str]:
    mass, height = float(model.body_mass.sum()), float(data.body(PELVIS).xpos[2])
    if not KILOGRAMS[0] <= mass <= KILOGRAMS[1]:
        yield f"{mass:.4g} kg"
    if not HEIGHT[0] <= height <= HEIGHT[1]:
        yield f"the pelvis stands at {height:.4g} m"


def _limbs(data: mujoco.MjData) -> Iterator[str]:
    for side, sign in zip(SIDES, (1, -1), strict=True):
        for end, least in (("foot", 3), ("hand", 2)):
            own, away = limb(side, end), sign * data.body(BODY_OF[f"{side}_{end}"]).xpos[1]
            if len(own) < least:
                yield f"{side}_{end}: {len(own)} joints from the trunk to it"
            if away <= 0:
                yield f"{side}_{end}: {abs(away):.3f} m on the other side"


def _sides() -> Iterator[str]:
    index, sign = mirrored_joints()
    for own, other, turn in zip(joints(), (joints()[i] for i in index), sign, strict=True):
        low, high = other.range if turn > 0 else (-other.range[1], -other.range[0])
        pairs = (
            ("range", own.range[0], low),
            ("range", own.range[1], high),
            ("effort_limit", own.effort_limit, other.effort_limit),
            ("armature", own.armature, other.armature),
        )
        for what, one, two in pairs:
            if abs(one - two) > ALIKE * max(abs(one), abs(two), 1e-3):
                yield f"{own.name} and {other.name}: {what} {one:.4g} and {two:.4g}"
                break


def _motors() -> Iterator[str]:
    for joint in joints():
        kp, kd = gains(joint)
        rotor = max(joint.armature, 1e-9)
        told = (
            ("effort_limit", joint.effort_limit, EFFORT, "N m"),
            ("velocity_limit", joint.velocity_limit, SPEED, "rad/s"),
            ("servo on its rotor", float(np.sqrt(kp / rotor)) / (2 * np.pi), FREQUENCY, "Hz"),
            ("its damping ratio", (kd + joint.damping) / max(2 * float(np.sqrt(kp * rotor)), 1e-9), DAMPING, ""),
        )
        for what, value, (low, high), unit in told:
            if not low <= value <= high:
                yield f"{joint.name}: {what} {value:.4g} {unit}, not from {low:g} to {high:g}"
        if not 0.02 < joint.range[1] - joint.range[0] <= 4 * np.pi:
            yield f"{joint.name}: a range of {joint.range[1] - joint.range[0]:.4g} rad"


def _stand(data: mujoco.MjData) -> Iterator[str]:
    for joint, angle in zip(joints(), stand_pose(), strict=True):
        if not joint.range[0] <= angle <= joint.range[1]:
            yield f"{joint.name}: {angle:.3g} rad, its range is {joint.range[0]:.3g} to {joint.range[1]:.3g}"
    rise = data.body(BODY_OF["left_shoulder"]).xpos + data.body(BODY_OF["right_shoulder"]).xpos
    rise = rise / 2 - (data.body(BODY_OF["left_hip"]).xpos + data.body(BODY_OF["right_hip"]).xpos) / 2
    if rise[2] < UPRIGHT * float(np.linalg.norm(rise)):
        lean = np.rad2deg(np.arccos(np.clip(rise[2] / np.linalg.norm(rise), -1, 1)))
        yield f"shoulders lean {lean:.0f} degrees from above the hips"


def _corners(data: mujoco.MjData) -> np.ndarray:
    """Lowest points of the soles' corners, (8, 3) [m, world]."""
    feet = [data.body(foot) for foot in FEET]
    centres = [
        foot.xpos + foot.xmat.reshape(3, 3) @ np.array(corner)
        for foot, own in zip(feet, SOLES, strict=True)
        for corner in own
    ]
    return np.array(centres) - (0.0, 0.0, SOLE_RADIUS)


def _soles(model: mujoco.MjModel, data: mujoco.MjData) -> Iterator[str]:
    height = _corners(data)[:, 2]
    if np.ptp(height) > FLAT:
        yield f"corners of the soles are {1000 * np.ptp(height):.0f} mm apart in height"
    for geom in range(1, model.ngeom):
        body = model.body(model.geom_bodyid[geom]).name
        low = (
            data.geom_xpos[geom, 2] - abs(data.geom_xmat[geom, 8]) * model.geom_size[geom, 1] - model.geom_size[geom, 0]
        )
        if body not in FEET and low < -FLAT:
            yield f"{body} is {1000 * -low:.0f} mm below the soles"


def _balance(data: mujoco.MjData) -> Iterator[str]:
    corners, centre = _corners(data)[:, :2], data.subtree_com[1, :2]
    low, high = corners.min(axis=0), corners.max(axis=0)
    beside = np.maximum(low - centre, centre - high).max()
    if beside > 0:
        yield f"the centre of mass is {1000 * beside:.0f} mm beside the soles"


def _strength(model: mujoco.MjModel, data: mujoco.MjData) -> Iterator[str]:
    torque = np.array(data.qfrc_bias)
    push = np.array([0.0, 0.0, 0.5 * 9.81 * model.body_mass.sum()])
    for foot, own in zip(FEET, np.split(_corners(data), 2), strict=True):
        jacobian = np.zeros((3, model.nv))
        mujoco.mj_jac(model, data, jacobian, None, own.mean(axis=0), model.body(foot).id)
        torque -= jacobian.T @ push
    for joint, needed in zip(joints(), np.abs(torque[6:]), strict=True):
        if needed > joint.effort_limit:
            yield f"{joint.name}: {needed:.3g} N m, its motor has {joint.effort_limit:g}"
        elif needed > SAG * gains(joint)[0]:
            yield f"{joint.name}: {needed:.3g} N m, by which its servo gives way {needed / gains(joint)[0]:.2g} rad"


def _shapes() -> Iterator[str]:
    model = build_model(RobotConfig(feet="capsules", self_collision=True))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    deepest: dict[tuple[str, str], float] = {}
    for contact in data.contact:
        pair = [model.body(model.geom_bodyid[geom]).name for geom in contact.geom]
        if "world" not in pair and not _near(model, *pair):
            key = (pair[0], pair[1])
            deepest[key] = min(deepest.get(key, 0.0), float(contact.dist))
    for (one, other), depth in deepest.items():
        if depth < -FLAT:
            yield f"{one} is {-1000 * depth:.0f} mm inside {other}"


def _near(model: mujoco.MjModel, one: str, other: str) -> bool:
    """Whether two links are at most three joints apart, as a hip or a shoulder is: what turns together may overlap."""
    chains = []
    for body in (one, other):
        found = [model.body(body).id]
        while found[-1]:
            found.append(int(model.body_parentid[found[-1]]))
        chains.append([body for body in found if model.body_jntnum[body] or body == found[0]])
    shared = set(chains[0]) & set(chains[1])
    return sum(body not in shared for chain in chains for body in chain) <= 3
