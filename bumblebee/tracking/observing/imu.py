"""The observation of a robot that has an IMU and encoders, and no odometry: no velocity, height or place of its base.

Everything that is compared is compared between robot and reference each in its own base frame, but for the orientation,
which an IMU gives; its heading is the gyro's, integrated, and drifts. The suffix `_o` names the reference's own frame.
"""

import torch
from torch import Tensor

from bumblebee.robot.facts import KEY_BODIES, PELVIS, joint_names
from bumblebee.sim.engine import RobotState
from bumblebee.sim.rotations import conjugate, matrix, turned, two_columns
from bumblebee.tracking.sampling.library import ReferenceFrame

_PELVIS = KEY_BODIES.index(PELVIS)
_OTHERS = len(KEY_BODIES) - 1


def imu_layout(joints: int = len(joint_names()), ahead: int = 0) -> list[tuple[str, int]]:
    """Names and sizes of the parts in order; `ahead` is the number of further reference frames."""
    parts = [
        ("gravity_b", 3),
        ("root_ang_vel_b", 3),
        ("joint_pos", joints),
        ("joint_vel", joints),
        ("last_action", joints),
        ("key_pos_b", 3 * _OTHERS),
        ("posture_error", 3 * _OTHERS),
        ("ref_rotation", 6),
        ("ref_lin_vel_o", 3),
        ("ref_ang_vel", 3),
        ("ref_height", 1),
        ("ref_joint_pos", joints),  # what an action of zero commands
        ("ref_joint_vel", joints),
    ]
    for i in range(1, ahead + 1):
        parts += [(f"ahead{i}_root_pos_o", 3), (f"ahead{i}_rotation", 6), (f"ahead{i}_joint_pos", joints)]
    return parts


def observe_imu(state: RobotState, ref: ReferenceFrame, last_action: Tensor) -> Tensor:
    """Observation (B, D), parts as in `imu_layout`; arguments as of `tracking.observing.observations.observe`."""
    to_base, to_ref = (matrix(conjugate(quat)) for quat in (state.root_quat_w, ref.root_quat_w))
    keys = state.key_pos_w if state.read_key_pos_w is None else state.read_key_pos_w
    own = turned(_others(keys - state.root_pos_w[:, None]), to_base)
    shifts = (_others(ref.key_pos_w - ref.root_pos_w[:, None]), ref.root_lin_vel_w[:, None])
    wanted = turned(torch.cat((*shifts, ref.ahead_root_pos_w - ref.root_pos_w[:, None]), dim=1), to_ref)
    columns = two_columns(torch.cat((ref.root_quat_w[:, None], ref.ahead_root_quat_w), dim=1)).flatten(1, 2)
    turns = turned(columns, to_base).unflatten(1, (-1, 2)).mT.flatten(2)  # (B, 1 + A, 6)
    parts = [
        -to_base[:, :, 2],
        state.root_ang_vel_b,
        state.joint_pos,
        state.joint_vel,
        last_action,
        own.flatten(1),
        (wanted[:, :_OTHERS] - own).flatten(1),
        turns[:, 0],
        wanted[:, _OTHERS],
        ref.root_ang_vel_b,
        ref.root_pos_w[:, 2:],
        ref.hold_pos,
        ref.joint_vel,
    ]
    for i in range(ref.ahead):
        parts += [wanted[:, _OTHERS + 1 + i], turns[:, 1 + i], ref.ahead_joint_pos[:, i]]
    return torch.cat(parts, dim=-1)


def _others(points: Tensor) -> Tensor:
    """All key bodies of (B, K, 3) but the pelvis; slices, since a list of numbers would be copied from the host."""
    return torch.cat((points[:, :_PELVIS], points[:, _PELVIS + 1 :]), dim=1)
