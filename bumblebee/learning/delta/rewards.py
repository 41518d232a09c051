"""Rewards of the delta-action policy, one function a row of the paper's table "Reward design for delta action model".

The table prints its regularisation rows with dots on quantities that have none; the reading here: the action rate is
the difference of two successive delta actions, the action norm is the norm of the delta action itself. Its limit rows
are indicators, 1(x not in [x_min, x_max]), of any joint, as in `tracking.rewards`; those of joints leave out what the
recording did too.
"""

from dataclasses import dataclass

import torch
from torch import Tensor

from bumblebee.ranges import Ranged, Weight
from bumblebee.sim.rotations import angle_between


@dataclass(frozen=True)
class DeltaRewardConfig(Ranged):
    """Weights of the table's rows."""

    torque_limits: Weight = -10.0
    """Row "Torque limits": any motor at its limit."""
    dof_pos_limits: Weight = -10.0
    """Row "DoF position limits": any joint beyond its range."""
    dof_vel_limits: Weight = -10.0
    """Row "DoF velocity limits": any joint beyond its speed."""
    termination: Weight = -200.0
    """Row "Termination"; multiplied by the control period like every row."""
    dof_acc: Weight = -3e-8
    """Row "DoF acceleration"."""
    action_rate: Weight = -2.0
    """Row "Action rate"."""
    action_norm: Weight = -2.0
    """Row "Action norm"."""
    torque: Weight = -1e-4
    """Row "Torque"."""
    root_pos: Weight = 1.0
    """Row "Root position"."""
    root_rot: Weight = 0.5
    """Row "Root rotation"."""
    root_ang_vel: Weight = 0.5
    """Row "Root angular velocity"."""
    root_vel: Weight = 0.5
    """Row "Root velocity"."""
    dof_pos: Weight = 0.5
    """Row "DoF position"."""
    dof_vel: Weight = 0.5
    """Row "DoF velocity"."""


def beyond(values: Tensor, low: Tensor, high: Tensor) -> Tensor:
    """Rows "... limits": 1(x not in [x_min, x_max]), whether any of the J values (B, J) is outside, (B,)."""
    return ((values < low) | (values > high)).any(dim=-1).float()


def beyond_alone(values: Tensor, recorded: Tensor, low: Tensor, high: Tensor, slack: float = 0.0) -> Tensor:
    """Penalty of any value more than `slack` outside whose recording (B, J) is inside, (B,).

    What the robot itself did costs nothing. With the row as printed a delta action earns more by keeping the
    simulator's joints off limits at which the robot's were than by following it (docs/decisions/delta-action.md).
    """
    outside = ((values < low - slack) | (values > high + slack)) & (recorded >= low) & (recorded <= high)
    return outside.any(dim=-1).float()


def squared_norm(values: Tensor) -> Tensor:
    """Rows "DoF acceleration" and "Action rate": ||x||^2 of (B, N), (B,)."""
    return values.square().sum(dim=-1)


def norm(values: Tensor) -> Tensor:
    """Rows "Action norm" and "Torque": ||x|| of (B, N), (B,)."""
    return values.norm(dim=-1)


def closeness(values: Tensor, reference: Tensor) -> Tensor:
    """Task rows: exp(-4 ||x - x_ref||^2) of (B, N), (B,)."""
    return torch.exp(-4.0 * (values - reference).square().sum(dim=-1))


def rotation_closeness(quat: Tensor, reference: Tensor) -> Tensor:
    """Row "Root rotation": exp(-4 angle^2), the angle [rad] between (B, 4) and (B, 4)."""
    return torch.exp(-4.0 * angle_between(reference, quat).square())
