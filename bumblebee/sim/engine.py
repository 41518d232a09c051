"""The simulator as the rest of the code sees it: many robots, stepped together at the control rate.

Everything is float32 torch on the engine's device, batch first; the order of joints is `joint_names()`, of key bodies
`KEY_BODIES`.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, Protocol

import mujoco
import numpy as np
import torch
from torch import Tensor


@dataclass(frozen=True)
class RobotState:
    """State of B robots at one control tick, by their sensors and forward kinematics.

    `root_pos_w` (B, 3) m and `root_quat_w` (B, 4) wxyz are the pelvis in the world; `root_lin_vel_b` (B, 3) m/s and
    `root_ang_vel_b` (B, 3) rad/s its velocity in its own frame; `joint_pos` (B, J) rad and `joint_vel` (B, J) rad/s;
    `key_pos_w` (B, 14, 3) m the key bodies' origins in the world. Where encoders are off, `read_key_pos_w` (B, 14, 3) m
    is where the readings put those bodies: all that a policy on the robot can know; None where they read the truth.
    """

    root_pos_w: Tensor
    root_quat_w: Tensor
    root_lin_vel_b: Tensor
    root_ang_vel_b: Tensor
    joint_pos: Tensor
    joint_vel: Tensor
    key_pos_w: Tensor
    read_key_pos_w: Tensor | None = None

    def __getitem__(self, ids: Tensor) -> "RobotState":
        """The state of some of the robots."""
        values: dict[str, Any] = {f.name: getattr(self, f.name) for f in fields(self)}
        some: dict[str, Any] = {name: None if value is None else value[ids] for name, value in values.items()}
        return RobotState(**some)


class Engine(Protocol):
    """B independent robots on a floor; `num_worlds` of them, stepped by `control_dt` seconds a call."""

    model: mujoco.MjModel
    num_worlds: int
    control_dt: float
    device: torch.device
    by_mask: bool
    """Whether `reset` is fastest with a mask: work of a fixed size, without a look at the values."""

    def set_fields(self, fields: Mapping[str, np.ndarray]) -> None:
        """Give each world its own values of some fields of the model: name -> (B, ...) as in `MjModel`.

        Constants that follow from masses and inertias are computed anew.
        """

    def reset(self, rows: Tensor, qpos: Tensor, qvel: Tensor, targets: Tensor) -> None:
        """Put some robots at qpos (n, 7 + J), qvel (n, 6 + J), as if `targets` (n, J) had long been held.

        `rows` are their indices (n,) in ascending order, or a mask (B,) bool; then the values are (B, ...) and only
        the chosen rows count. Call `settle` before the next `state`. qpos is root position, orientation wxyz, joints;
        qvel is root velocity in the world, angular velocity in the base frame, joints (MuJoCo's convention).
        """

    def settle(self) -> None:
        """Make the bodies' places of the robots that were reset current."""

    def check(self) -> None:
        """Raise `BadInput` if the engine had to drop contacts or constraints; may wait for the device."""

    def step(self, targets: Tensor) -> None:
        """Hold the joint targets (B, J) [rad] for one control period."""

    def state(self) -> RobotState:
        """Sensors and key bodies now; the tensors are the caller's to keep."""

    def torque(self) -> Tensor:
        """Motor torques (B, J) [N m] of the last physics step."""

    def foot_force_w(self) -> Tensor:
        """Contact force of the floor on each foot, (B, 2, 3) [N] in the world, left then right."""

    def foot_quat_w(self) -> Tensor:
        """Orientation of each foot, (B, 2, 4) wxyz, left then right."""

    def push(self, velocity_w: Tensor) -> None:
        """Add velocity_w (B, 3) [m/s] to the roots' velocity."""

    def unstable(self) -> Tensor:
        """Worlds (B,) bool whose state stopped being a number in the last step; they must be reset."""

    def state_dict(self) -> dict[str, Any]:
        """All that the next step depends on, to go on later from here."""

    def load_state_dict(self, saved: dict[str, Any]) -> None:
        """Go on from what `state_dict` gave."""
