"""The reward: one small function for each row of the paper's table (appendix B, "Reward design for WBC").

Every term maps a `Step` to (B,) and knows nothing of its weight. Norms over joints are Euclidean; the body position is
the mean distance of the 14 key bodies. What the table leaves open is decided in docs/decisions/rewards.md.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Annotated, Literal

import torch
from torch import Tensor

from bumblebee.ranges import Factor, Name, Range, Ranged, Share, Weight
from bumblebee.robot.facts import joints
from bumblebee.sim.engine import RobotState
from bumblebee.sim.rotations import angle_between, length3, rotate
from bumblebee.tracking.sampling.library import ReferenceFrame
from bumblebee.tracking.terminations import threshold_at


@dataclass(frozen=True)
class Limits:
    """Limits of the joints, (J,) each: torque [N m], lowest and highest angle [rad], speed [rad/s]."""

    torque: Tensor
    low: Tensor
    high: Tensor
    speed: Tensor

    @classmethod
    def of_robot(cls, soft: float = 1.0, device: torch.device | str = "cpu") -> "Limits":
        """The G1's, with torque, speed and half range times `soft`."""
        table = joints()
        low, high = (torch.tensor([j.range[i] for j in table], device=device) for i in (0, 1))
        middle, half = (low + high) / 2, (high - low) / 2 * soft
        torque = torch.tensor([float(j.effort_limit) for j in table], device=device) * soft
        speed = torch.tensor([float(j.velocity_limit) for j in table], device=device) * soft
        return cls(torque, middle - half, middle + half, speed)


@dataclass(frozen=True)
class Step:
    """Inputs of the reward of one control step; actions (B, J) are the policy's outputs, newest first.

    Errors that also end episodes or stand in the learning curve are worked out once: `key_errors` (B, K) [m] of the key
    bodies, `root_angle` (B,) [rad], `velocity_error` (B,) [m/s] of the root and `joint_error` (B,) [rad], a norm.
    """

    state: RobotState
    ref: ReferenceFrame
    torque: Tensor
    joint_acc: Tensor
    actions: tuple[Tensor, Tensor, Tensor]
    foot_force_w: Tensor
    foot_quat_w: Tensor
    limits: Limits
    key_errors: Tensor = field(init=False)
    root_angle: Tensor = field(init=False)
    velocity_error: Tensor = field(init=False)
    joint_error: Tensor = field(init=False)

    def __post_init__(self) -> None:
        """Work out the errors."""
        state, ref = self.state, self.ref
        velocity_w = rotate(state.root_quat_w, state.root_lin_vel_b)
        errors = {
            "key_errors": length3(state.key_pos_w - ref.key_pos_w),
            "root_angle": angle_between(state.root_quat_w, ref.root_quat_w),
            "velocity_error": length3(velocity_w - ref.root_lin_vel_w),
            "joint_error": (state.joint_pos - ref.joint_pos).norm(dim=-1),
        }
        for name, error in errors.items():
            object.__setattr__(self, name, error)


def torque_limits(step: Step) -> Tensor:
    """Torque limits: 1(tau not in [tau_min, tau_max]), any joint."""
    return (step.torque.abs() > step.limits.torque).any(-1).float()


def dof_position_limits(step: Step) -> Tensor:
    """DoF position limits: 1(d not in [q_min, q_max]), any joint."""
    outside = (step.state.joint_pos < step.limits.low) | (step.state.joint_pos > step.limits.high)
    return outside.any(-1).float()


def dof_velocity_limits(step: Step) -> Tensor:
    """DoF velocity limits: 1(d' not in [q'_min, q'_max]), any joint."""
    return (step.state.joint_vel.abs() > step.limits.speed).any(-1).float()


def dof_acceleration(step: Step) -> Tensor:
    """DoF acceleration: |d''|^2 [rad^2/s^4]."""
    return step.joint_acc.square().sum(-1)


def action_rate(step: Step) -> Tensor:
    """Action rate: |a_t - a_(t-1)|^2."""
    return (step.actions[0] - step.actions[1]).square().sum(-1)


def action_smoothness(step: Step) -> Tensor:
    """Action smoothness: |a'_t - a'_(t-1)|^2, the second difference of the action."""
    now, before, earlier = step.actions
    return (now - 2 * before + earlier).square().sum(-1)


def torque(step: Step) -> Tensor:
    """Torque: |tau| [N m]."""
    return step.torque.norm(dim=-1)


def stumble(step: Step) -> Tensor:
    """Stumble: 1(F_xy > 5 F_z), either foot."""
    force = step.foot_force_w
    return (force[..., :2].norm(dim=-1) > 5 * force[..., 2].abs()).any(-1).float()


def feet_orientation(step: Step) -> Tensor:
    """Feet orientation: sum over the feet of |gravity_xy| in the foot's frame; 0 when both soles are level."""
    ww, xx, yy, zz = step.foot_quat_w.square().unbind(-1)
    # The sine of the tilt: (xz - wy)^2 + (yz + wx)^2 = (xx + yy) (zz + ww).
    return 2 * ((xx + yy) * (zz + ww)).clamp(min=1e-20).sqrt().sum(-1)  # at 0 the root's gradient is infinite


def body_position(step: Step) -> Tensor:
    """Body position, the error: |p_body - p_ref|, mean over the key bodies [m]."""
    return step.key_errors.mean(-1)


def root_rotation(step: Step) -> Tensor:
    """Root rotation, the error: angle between the roots [rad]."""
    return step.root_angle


def root_angular_velocity(step: Step) -> Tensor:
    """Root angular velocity, the error: |omega - omega_ref| [rad/s], each in its own base frame."""
    return (step.state.root_ang_vel_b - step.ref.root_ang_vel_b).norm(dim=-1)


def root_velocity(step: Step) -> Tensor:
    """Root velocity, the error: |v - v_ref| in the world [m/s]."""
    return step.velocity_error


def dof_position(step: Step) -> Tensor:
    """DoF position, the error: |d - d_ref| [rad]."""
    return step.joint_error


def dof_velocity(step: Step) -> Tensor:
    """DoF velocity, the error: |d' - d'_ref| [rad/s]."""
    return (step.state.joint_vel - step.ref.joint_vel).norm(dim=-1)


def alive(step: Step) -> Tensor:
    """Not in the table: 1 for each step that does not end the episode."""
    return torch.ones_like(step.torque[:, 0])


PENALTIES: dict[str, Callable[[Step], Tensor]] = {
    f.__name__: f
    for f in (
        torque_limits,
        dof_position_limits,
        dof_velocity_limits,
        dof_acceleration,
        action_rate,
        action_smoothness,
        torque,
        stumble,
        feet_orientation,
        alive,
    )
}
"""Terms that enter as they are."""

ERRORS: dict[str, Callable[[Step], Tensor]] = {
    f.__name__: f
    for f in (body_position, root_rotation, root_angular_velocity, root_velocity, dof_position, dof_velocity)
}
"""Terms that enter as exp(-sharpness * error)."""

PAPER_WEIGHTS = {
    "torque_limits": -10.0,
    "dof_position_limits": -10.0,
    "dof_velocity_limits": -10.0,
    "dof_acceleration": -3e-8,
    "action_rate": -2.0,
    "action_smoothness": -2.0,
    "torque": -1e-4,
    "stumble": -0.00125,
    "feet_orientation": -2.0,
    "body_position": 1.0,
    "root_rotation": 0.5,
    "root_angular_velocity": 0.5,
    "root_velocity": 0.5,
    "dof_position": 0.5,
    "dof_velocity": 0.5,
}
PAPER_SHARPNESS = dict.fromkeys(ERRORS, 4.0)

DEMO_WEIGHTS = PAPER_WEIGHTS | {
    "torque_limits": -0.1,
    "dof_position_limits": -0.2,
    "dof_velocity_limits": -0.1,
    "action_rate": -0.01,
    "action_smoothness": -0.002,
    "feet_orientation": -0.1,
    "body_position": 2.0,
    "alive": 0.5,
}
DEMO_SHARPNESS = {
    "body_position": 6.0,
    "root_rotation": 3.0,
    "root_angular_velocity": 0.5,
    "root_velocity": 2.0,
    "dof_position": 1.0,
    "dof_velocity": 0.1,
}


@dataclass(frozen=True)
class RewardConfig(Ranged):
    """Which weights and kernels the reward has; docs/decisions/rewards.md says why there are two sets."""

    preset: Literal["demo", "paper"] = "demo"
    """`paper`: the table's weights and sharpness; `demo`: the same terms, tuned for minutes on a CPU."""
    weights: dict[Name, Weight] = field(default_factory=dict)
    """Weights that replace the preset's, by term."""
    sharpness: dict[Name, Factor] = field(default_factory=dict)
    """Factors in exp(-factor * error) that replace the preset's, by term."""
    soft_limit: Annotated[float, Range(above=0, most=1)] = 0.95
    """Share of a torque, position or velocity limit beyond which it counts as exceeded."""
    ramp_start: Share = 1.0
    """Factor on all punishing terms at the training's start, from which it grows evenly to 1."""
    ramp_share: Share = 0.0
    """Share of the training over which it grows; with 0 it is 1 throughout."""
    floor: Annotated[float, Range(least=-1000, most=0)] | None = None
    """Least reward of a step, before the control period: with 0, to fall early is never worth more than to live.
    None: no limit."""

    def __post_init__(self) -> None:
        """Refuse terms that there are not."""
        super().__post_init__()
        self.require_names("weights", [*PENALTIES, *ERRORS])
        self.require_names("sharpness", ERRORS)


class Reward:
    """The weighted sum of the terms, times the control period (so that a second in perfect tracking gives ~ 1).

    Args:
        config: preset and what replaces its values; an unknown term is an error.
        dt: control period [s].
        device: where the steps' tensors are.
    """

    def __init__(self, config: RewardConfig, dt: float, device: torch.device | str = "cpu") -> None:
        paper = config.preset == "paper"
        self.weights = (PAPER_WEIGHTS if paper else DEMO_WEIGHTS) | config.weights
        self.sharpness = (PAPER_SHARPNESS if paper else DEMO_SHARPNESS) | config.sharpness
        self.dt = dt
        self._penalties = [name for name, weight in self.weights.items() if weight and name in PENALTIES]
        self._errors = [name for name, weight in self.weights.items() if weight and name in ERRORS]
        # Columns, so that one product serves all terms.
        self._whole = _column([self.weights[name] for name in (*self._penalties, *self._errors)], device)
        self._ramped, self._floor = self._whole < 0, config.floor
        self._ramp = (config.ramp_start, 1.0, config.ramp_share)
        self._weights = self._whole.clone()  # written in place, where a recorded graph reads it
        self.progress(0.0)
        self._sharpness = _column([self.sharpness[name] for name in self._errors], device)

    def progress(self, done: float) -> None:
        """Weigh punishing terms as they are after this share of the training."""
        factor = threshold_at(done, *self._ramp)
        self._weights.copy_(torch.where(self._ramped, factor * self._whole, self._whole))

    def terms(self, step: Step) -> dict[str, Tensor]:
        """Each term with its weight, (B,)."""
        return dict(zip([*self._penalties, *self._errors], self._weighted(step).unbind(), strict=True))

    def _weighted(self, step: Step) -> Tensor:
        """All terms with their weights, (terms, B), penalties before errors."""
        errors = [ERRORS[name](step) for name in self._errors]
        kernels = [torch.exp(-self._sharpness * torch.stack(errors))] if errors else []
        penalties = [PENALTIES[name](step)[None] for name in self._penalties]
        return self._weights * torch.cat(penalties + kernels)

    def __call__(self, step: Step) -> Tensor:
        """The reward of the step, (B,)."""
        earned = self._weighted(step).sum(0)
        return self.dt * (earned if self._floor is None else earned.clamp(min=self._floor))


def _column(values: list[float], device: torch.device | str) -> Tensor:
    """Values as a column (n, 1)."""
    return torch.tensor(values, dtype=torch.float32, device=device)[:, None]
