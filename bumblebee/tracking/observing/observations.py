"""Observation of the policy: the robot, the reference one control step ahead, and the difference, in the base frame.

Everything here is computable on the robot from orientation, gyro, odometry (velocity, position), encoders and forward
kinematics; nothing depends on the heading or the place in the world (paper, section 3.2: proprioception and goal).
"""

import torch
from torch import Tensor

from bumblebee.robot.facts import KEY_BODIES, PELVIS, joint_names, joints, stand_pose
from bumblebee.robot.model import gains
from bumblebee.sim.engine import RobotState
from bumblebee.sim.rotations import conjugate, matrix, turned, two_columns
from bumblebee.tracking.sampling.library import ReferenceFrame

_PELVIS = KEY_BODIES.index(PELVIS)


def layout(joints: int = len(joint_names()), ahead: int = 0) -> list[tuple[str, int]]:
    """Names and sizes of the parts of the observation in order; `ahead` is the number of further reference frames."""
    keys = len(KEY_BODIES)
    parts = [
        ("gravity_b", 3),
        ("root_lin_vel_b", 3),
        ("root_ang_vel_b", 3),
        ("root_height", 1),
        ("joint_pos", joints),
        ("joint_vel", joints),
        ("last_action", joints),
        ("key_pos_b", 3 * (keys - 1)),
        ("key_error_b", 3 * keys),
        ("ref_rotation", 6),
        ("ref_lin_vel_b", 3),
        ("ref_ang_vel", 3),
        ("ref_height", 1),
        ("ref_joint_pos", joints),  # what an action of zero commands
        ("ref_joint_vel", joints),
    ]
    for i in range(1, ahead + 1):
        parts += [(f"ahead{i}_root_pos_b", 3), (f"ahead{i}_rotation", 6), (f"ahead{i}_joint_pos", joints)]
    return parts


def observe(state: RobotState, ref: ReferenceFrame, last_action: Tensor) -> Tensor:
    """Observation (B, D), parts as in `layout`.

    Args:
        state: the robots now.
        ref: the reference at the end of the coming control period (frame t+1), with its frames further ahead.
        last_action: (B, J) the policy's previous output, zeros at the start.
    """
    quat = state.root_quat_w
    to_base = matrix(conjugate(quat))  # (B, 3, 3)
    root = state.root_pos_w[:, None]
    keys = state.key_pos_w if state.read_key_pos_w is None else state.read_key_pos_w
    count = len(KEY_BODIES)
    # One product for all vectors and columns of rotations: small operations cost a CPU more than their arithmetic.
    columns = two_columns(torch.cat((ref.root_quat_w[:, None], ref.ahead_root_quat_w), dim=1)).flatten(1, 2)
    speed = ref.root_lin_vel_w[:, None]
    shifts = (keys - root, ref.key_pos_w - keys, ref.ahead_root_pos_w - root)
    vectors_b = turned(torch.cat((*shifts, speed, columns), dim=1), to_base)
    first = 2 * count + ref.ahead + 1  # of the columns
    turns = torch.stack((vectors_b[:, first::2], vectors_b[:, first + 1 :: 2]), dim=-1).flatten(2)  # (B, 1 + A, 6)
    parts = [
        -to_base[:, :, 2],
        state.root_lin_vel_b,
        state.root_ang_vel_b,
        state.root_pos_w[:, 2:],
        state.joint_pos,
        state.joint_vel,
        last_action,
        vectors_b[:, :_PELVIS].flatten(1),
        vectors_b[:, _PELVIS + 1 : 2 * count].flatten(1),
        turns[:, 0],
        vectors_b[:, first - 1],
        ref.root_ang_vel_b,
        ref.root_pos_w[:, 2:],
        ref.hold_pos,
        ref.joint_vel,
    ]
    for i in range(ref.ahead):
        parts += [vectors_b[:, 2 * count + i], turns[:, 1 + i], ref.ahead_joint_pos[:, i]]
    return torch.cat(parts, dim=-1)


def joint_targets(ref: ReferenceFrame, action: Tensor, scale: Tensor, middle: Tensor | None = None) -> Tensor:
    """Targets (B, J) [rad] of the position servos.

    What holds the reference one step ahead against gravity, or `middle` (J,) [rad], plus scale (J,) [rad] times action.
    """
    return middle_targets(ref, middle) + scale * action


def middle_targets(ref: ReferenceFrame, middle: Tensor | None) -> Tensor:
    """Targets (B, J) [rad] of an action of zero: what holds the reference, or `middle` (J,) for all."""
    return ref.hold_pos if middle is None else middle.expand_as(ref.joint_pos)


def action_middle(kind: str) -> Tensor | None:
    """The joint targets (J,) [rad] of an action of zero: the relaxed stand for "default", None for the reference."""
    return torch.tensor(stand_pose(), dtype=torch.float32) if kind == "default" else None


def action_scale() -> Tensor:
    """Scale of the action (J,) [rad]: a quarter of the angle at which the servo reaches its torque limit, bounded."""
    scale = [0.25 * joint.effort_limit / gains(joint)[0] for joint in joints()]
    return torch.tensor(scale, dtype=torch.float32).clamp(0.08, 0.35)
