"""Readings of the robot that an observation depends on, found by changing one reading at a time."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import lru_cache

import torch
from torch import Tensor

from bumblebee.robot.facts import KEY_BODIES, joint_names
from bumblebee.sim.engine import RobotState
from bumblebee.sim.rotations import from_rotation_vector, multiply, rotate
from bumblebee.tracking.observing.terms import see
from bumblebee.tracking.sampling.library import ReferenceFrame

READINGS = {
    "imu": "which way is down, and the gyro",
    "heading": "yaw from where the clip begins, as an IMU integrates it",
    "encoders": "angles and speeds of the joints",
    "velocity": "velocity of the pelvis, from odometry",
    "height": "height of the pelvis above the floor, from odometry",
    "place": "place of the pelvis in the plane from where the clip begins, from odometry",
}
"""Readings that a policy may need, each explained."""


def needed(terms: Sequence[str], joints: int = len(joint_names()), ahead: int = 0) -> tuple[str, ...]:
    """Names of the `READINGS` that an observation of these terms, sets replaced by theirs, depends on."""
    return _needed(tuple(terms), joints, ahead)


@lru_cache
def _needed(terms: tuple[str, ...], joints: int, ahead: int) -> tuple[str, ...]:
    state, ref, action = _situation(joints, ahead)
    plain = see(terms, state, ref, action)
    return tuple(
        name for name, change in _CHANGES.items() if (see(terms, change(state), ref, action) - plain).abs().max() > 1e-6
    )


def _situation(joints: int, ahead: int) -> tuple[RobotState, ReferenceFrame, Tensor]:
    """A robot, its reference and its last action, drawn at random, in double precision."""
    generator, keys = torch.Generator().manual_seed(0), len(KEY_BODIES)

    def normal(*shape: int) -> Tensor:
        return torch.randn(1, *shape, generator=generator, dtype=torch.float64)

    def quat(*shape: int) -> Tensor:
        return torch.nn.functional.normalize(normal(*shape, 4), dim=-1)

    body = [(normal(3), quat(), normal(3), normal(3), normal(joints), normal(joints), normal(keys, 3)) for _ in "ab"]
    further = (normal(joints), normal(ahead, 3), quat(ahead), normal(ahead, joints))
    return RobotState(*body[0]), ReferenceFrame(*body[1], *further), normal(joints)


def _carried(state: RobotState, axis: int | None = None, shift: tuple[float, ...] = (0.0, 0.0, 0.0)) -> RobotState:
    """The robot turned by a tenth of a turn about an axis of the world through its pelvis, and shifted [m]."""
    vector = torch.zeros(1, 3, dtype=torch.float64)
    if axis is not None:
        vector[0, axis] = math.tau / 10
    turn, root = from_rotation_vector(vector), state.root_pos_w + torch.tensor(shift, dtype=torch.float64)
    keys = rotate(turn[:, None].expand(-1, state.key_pos_w.shape[1], -1), state.key_pos_w - state.root_pos_w[:, None])
    return replace(
        state, root_pos_w=root, root_quat_w=multiply(turn, state.root_quat_w), key_pos_w=keys + root[:, None]
    )


_CHANGES: dict[str, Callable[[RobotState], RobotState]] = {
    "imu": lambda state: replace(_carried(state, axis=0), root_ang_vel_b=state.root_ang_vel_b + 1),
    "heading": lambda state: _carried(state, axis=2),
    "encoders": lambda state: replace(
        state, joint_pos=state.joint_pos + 1, joint_vel=state.joint_vel + 1, key_pos_w=state.key_pos_w.flip(1)
    ),
    "velocity": lambda state: replace(state, root_lin_vel_b=state.root_lin_vel_b + 1),
    "height": lambda state: _carried(state, shift=(0.0, 0.0, 1.0)),
    "place": lambda state: _carried(state, shift=(1.0, 1.0, 0.0)),
}
