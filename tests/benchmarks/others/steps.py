"""A step of robots that stand upright on the spot, as the rows and terms of the baselines see it."""

from dataclasses import replace

import torch

from benchmarks.baselines.others.library import MovingFrame
from benchmarks.baselines.others.memory import Now
from benchmarks.baselines.others.scoring import Judged
from bumblebee.sim.engine import RobotState
from bumblebee.tracking.rewards import Limits, Step

J, K = 23, 14


def turn_z(angle: float) -> torch.Tensor:
    """Quaternion (4,) of a turn about the vertical [rad]."""
    half = torch.tensor(angle / 2)
    return torch.stack((torch.cos(half), torch.zeros(()), torch.zeros(()), torch.sin(half)))


def state(n: int = 1, **changes: torch.Tensor) -> RobotState:
    """Robots at the origin, 0.8 m up, all key bodies in the pelvis."""
    upright = torch.tensor([1.0, 0.0, 0.0, 0.0]).repeat(n, 1)
    place = torch.tensor([0.0, 0.0, 0.8]).repeat(n, 1)
    keys = place[:, None].repeat(1, K, 1)
    made = RobotState(place, upright, torch.zeros(n, 3), torch.zeros(n, 3), torch.zeros(n, J), torch.zeros(n, J), keys)
    return replace(made, **changes)


def reference(n: int = 1, **changes: torch.Tensor) -> MovingFrame:
    """Reference at the place and pose of `state`, at rest, with one frame further ahead."""
    s = state(n)
    made = MovingFrame(
        root_pos_w=s.root_pos_w,
        root_quat_w=s.root_quat_w,
        root_lin_vel_w=torch.zeros(n, 3),
        root_ang_vel_b=torch.zeros(n, 3),
        joint_pos=torch.zeros(n, J),
        joint_vel=torch.zeros(n, J),
        key_pos_w=s.key_pos_w,
        lead=torch.zeros(n, J),
        ahead_root_pos_w=s.root_pos_w[:, None],
        ahead_root_quat_w=s.root_quat_w[:, None],
        ahead_joint_pos=torch.zeros(n, 1, J),
        key_vel_w=torch.zeros(n, K, 3),
    )
    return replace(made, **changes)


def judged(
    now: RobotState | None = None,
    ref: MovingFrame | None = None,
    feet: dict | None = None,
    lost: bool = False,
    **step: torch.Tensor,
) -> Judged:
    """One robot's step: both feet on the floor with 150 N each, no action, unless said otherwise."""
    upright = torch.tensor([1.0, 0.0, 0.0, 0.0])
    zeros = torch.zeros(1, J)
    made = Step(
        state=now or state(),
        ref=ref or reference(),
        torque=zeros,
        joint_acc=zeros,
        actions=(zeros, zeros, zeros),
        foot_force_w=torch.tensor([[[0.0, 0.0, 150.0], [0.0, 0.0, 150.0]]]),
        foot_quat_w=upright.repeat(1, 2, 1),
        limits=Limits(torch.full((J,), 10.0), torch.full((J,), -1.0), torch.full((J,), 1.0), torch.full((J,), 5.0)),
    )
    past = {
        "key_vel_w": torch.zeros(1, K, 3),
        "contact": torch.ones(1, 2, dtype=torch.bool),
        "landed": torch.zeros(1, 2, dtype=torch.bool),
        "air_time": torch.zeros(1, 2),
        "height": torch.zeros(1, 2),
    }
    return Judged(replace(made, **step), Now(**(past | (feet or {}))), torch.tensor([lost]))
