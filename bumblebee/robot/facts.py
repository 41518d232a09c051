"""The robot of this process as data: joints in order, their limits and motors, the bodies that are tracked.

Which robot that is says `robot.folder`. By default it is the Unitree G1 with 23 of its 29 joints, those without the six
of the wrists (paper, section 4.1); that is not the hardware variant which Unitree sells as "23 DoF".
"""

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from bumblebee.robot.folder import chosen, stand_names
from bumblebee.robot.shapes import Bodies
from bumblebee.robot.written import ROLES, SIDES, Vector

_SAID = chosen().written
ROBOT = _SAID.robot
"""As exported policies, compensations and logs name it."""
IDENTITY = chosen().sha256
"""Hash of what a policy depends on; two robots of one name differ in it."""
HELD_JOINTS = _SAID.held
"""Joints that the robot has and that are held at 0 here; the G1's wrists."""
BODY_OF = {role: body if place is None else role for role, (body, place) in _SAID.key_bodies.items()}
"""The body that plays a role (`written.ROLES`)."""
KEY_BODIES = tuple(BODY_OF[role] for role in ROLES)
"""The 14 bodies whose positions are tracked ("keypoints"), in the order of `written.ROLES`."""
PELVIS, TORSO = BODY_OF["pelvis"], BODY_OF["torso"]
TRUNK = _SAID.key_bodies["torso"][0]
"""The body with the torso's mass: the torso itself, or the one that it is a point of."""
FEET = (BODY_OF["left_foot"], BODY_OF["right_foot"])
HEAD: tuple[str, Vector] = _SAID.head
"""Body and place in its frame [m]."""
SOLES = tuple(_SAID.soles[side] for side in SIDES)
"""Corners of both soles in the frames of `FEET` [m], as centres of spheres of `SOLE_RADIUS`."""
SOLE_RADIUS = _SAID.sole_radius
LAYOUTS = _SAID.layouts
"""Joints that files of a known layout leave out, by the layout's name."""


@dataclass(frozen=True)
class Joint:
    """One actuated hinge: `range` [rad], `effort_limit` [N m], `velocity_limit` [rad/s], `armature` [kg m^2].

    `kp` [N m/rad] and `kd` [N m s/rad] are None where the rotor's inertia tells them (`model.gains`); `damping`
    [N m s/rad] and `frictionloss` [N m] are what the maker's model declares beside the servo.
    """

    name: str
    axis: tuple[float, float, float]
    range: tuple[float, float]
    motor: str
    effort_limit: float
    velocity_limit: float
    armature: float
    kp: float | None = None
    kd: float | None = None
    damping: float = 0.0
    frictionloss: float = 0.0


def robot_bodies() -> Bodies:
    """The table itself: body name -> parent, pose, inertia, joint, collision primitives, sites; parents come first."""
    return chosen().bodies


@cache
def joints(every: bool = False) -> tuple[Joint, ...]:
    """The robot's joints in the model's order: those that are actuated, or `every` one."""
    found = [made_joint(body["joint"]) for body in robot_bodies().values() if "joint" in body]
    return tuple(joint for joint in found if every or joint.name not in HELD_JOINTS)


def joint_names(every: bool = False) -> tuple[str, ...]:
    """Names of `joints(every)`; those of the actuated ones are the column order of every array of joint values."""
    return tuple(joint.name for joint in joints(every))


def stand_pose(every: bool = False) -> np.ndarray:
    """Joint angles of the relaxed stand, (J,) [rad]; a side's joints may share a line of the robot's file."""

    def angle(name: str) -> float:
        return next((_SAID.stand[key] for key in stand_names(name) if key in _SAID.stand), 0.0)

    return np.array([angle(name) for name in joint_names(every)])


def limb(side: str, end: str) -> tuple[str, ...]:
    """Actuated joints from the trunk to a limb's end (`foot` or `hand`), the trunk's own left out."""
    return _joints_of(limb_bodies(side, end))


@cache
def limb_bodies(side: str, end: str) -> tuple[str, ...]:
    """Bodies from the trunk to a limb's end, the trunk's own left out."""
    trunk = {*path_to(PELVIS), *path_to(TORSO)}
    return tuple(body for body in path_to(BODY_OF[f"{side}_{end}"]) if body not in trunk)


def ankles(side: str) -> tuple[str, ...]:
    """Actuated joints between a side's shin and its foot."""
    shin = path_to(BODY_OF[f"{side}_knee"])
    return _joints_of(tuple(body for body in path_to(BODY_OF[f"{side}_foot"]) if body not in shin))


def columns(names: tuple[str, ...]) -> list[int]:
    """Columns of these joints in arrays of joint values."""
    return [joint_names().index(name) for name in names]


def made_joint(table: dict[str, Any]) -> Joint:
    """A joint of the table."""
    told: dict[str, Any] = {key: tuple(value) if isinstance(value, list) else value for key, value in table.items()}
    return Joint(**told)


def path_to(body: str) -> list[str]:
    """Bodies from the root to this one."""
    found = [body]
    while (parent := robot_bodies()[found[-1]]["parent"]) != "world":
        found.append(parent)
    return found[::-1]


def _joints_of(bodies: tuple[str, ...]) -> tuple[str, ...]:
    names = [robot_bodies()[body]["joint"]["name"] for body in bodies if "joint" in robot_bodies()[body]]
    return tuple(name for name in names if name not in HELD_JOINTS)


ANKLE_JOINTS = tuple(name for side in SIDES for name in ankles(side))
