"""Sensor noise of the policy's observation: uniform, by part, at the levels of the robot's sensors and odometry."""

import torch
from torch import Tensor

LEVELS = {
    "gravity_b": 0.02,
    "root_lin_vel_b": 0.1,  # m/s: odometry
    "root_ang_vel_b": 0.1,  # rad/s
    "root_height": 0.01,
    "joint_pos": 0.01,  # rad
    "joint_vel": 0.3,  # rad/s
    "key_pos_b": 0.005,
    "posture_error": 0.005,
    "key_error_b": 0.02,  # m
    "ref_rotation": 0.02,
    "ref_lin_vel_b": 0.02,
    "root_rotation_g": 0.02,
    "target_key_pos_g": 0.02,
    "target_root_pos_g": 0.02,
    "target_key_pos_b": 0.02,
    "target_root_pos_b": 0.02,
    "target_root_rotation_b": 0.02,
    "target_lin_vel_b": 0.02,
}
"""Largest error of each part; parts that are not named carry none. Look-ahead parts are matched by their ending."""


def noise_levels(layout: list[tuple[str, int]]) -> Tensor:
    """Largest error of each entry of the observation, (D,)."""
    levels = []
    for name, size in layout:
        if name.endswith("_root_pos_b"):
            level = LEVELS["key_error_b"]
        elif name.startswith("ahead") and name.endswith("_rotation"):
            level = LEVELS["ref_rotation"]
        else:
            level = LEVELS.get(name, 0.0)
        levels.append(torch.full((size,), level))
    return torch.cat(levels)
