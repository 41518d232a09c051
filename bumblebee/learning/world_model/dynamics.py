"""The world model: from a state and servo targets to the state one control step later."""

import math
from collections.abc import Callable, Sequence
from copy import deepcopy

import torch
from torch import Tensor, nn

from bumblebee.learning.ranks import Ranks
from bumblebee.learning.world_model.body import change_of, difference, features, joint_pos, moved

SPREADS = (0.05, 0.05, 0.05, 0.1, 0.1, 0.1, 0.3, 0.3, 0.3, 0.6, 0.6, 0.6)
"""Errors of the root's place [m], turn [rad], velocity [m/s] and angular velocity [rad/s] that count as one."""
ANGLE, SPEED = 0.1, 1.5
"""Errors of joint angles [rad] and joint velocities [rad/s] that count as one."""

Predict = Callable[[Tensor, Tensor, Tensor, Tensor], Tensor]
"""Signature of `Dynamics.forward`."""


def past_targets(delay: float, dt: float) -> int:
    """How many earlier targets may act in a control step of `dt` [s], of servos late by `delay` [s]; at least 1."""
    return max(math.ceil(delay / dt - 1e-6), 1)


def handed_on(target: Tensor, before: Tensor) -> Tensor:
    """Earlier targets for the next step (B, P J), from this step's targets (B, J) and those before it (B, P J)."""
    return torch.cat((target, before[:, : -target.shape[1]]), dim=-1)


class Dynamics(nn.Module):
    """Predicts what one control step changes beyond uniform motion.

    Args:
        joints: J.
        hidden: widths of the layers.
        dt: control period [s].
        context: entries of the vector that says in what a world differs; 0 where all are alike.
        past: P, earlier targets that may still act, see `past_targets`.
    """

    mean: Tensor
    std: Tensor
    scale: Tensor
    spread: Tensor

    def __init__(self, joints: int, hidden: Sequence[int], dt: float, context: int = 0, past: int = 1) -> None:
        super().__init__()
        self.dt, self._past = dt, past
        seen = size = 10 + (3 + past) * joints + context
        layers: list[nn.Module] = []
        for width in hidden:
            layers += [nn.Linear(size, width), nn.LayerNorm(width), nn.SiLU()]
            size = width
        last = nn.Linear(size, 12 + 2 * joints)
        with torch.no_grad():
            last.weight.mul_(0.1)
            last.bias.zero_()
        self.layers: nn.Module = nn.Sequential(*layers, last)
        self.register_buffer("mean", torch.zeros(seen))
        self.register_buffer("std", torch.ones(seen))
        self.register_buffer("scale", torch.ones(12 + 2 * joints))
        self.register_buffer("spread", torch.tensor([*SPREADS, *[ANGLE] * joints, *[SPEED] * joints]))

    def seen(self, body: Tensor, target: Tensor, before: Tensor, context: Tensor) -> Tensor:
        """The network's input (B, 10 + (3 + P) J + C) before it is normalised."""
        angle = joint_pos(body)
        return torch.cat((features(body), target - angle, before - angle.repeat(1, self._past), context), dim=-1)

    def normalised(self, body: Tensor, target: Tensor, before: Tensor, context: Tensor) -> Tensor:
        """The network's input (B, 10 + (3 + P) J + C) in units of its spread, bounded."""
        return ((self.seen(body, target, before, context) - self.mean) / self.std).clamp(-10, 10)

    def forward(self, body: Tensor, target: Tensor, before: Tensor, context: Tensor) -> Tensor:
        """The next state (B, 13 + 2 J).

        Args:
            body: (B, 13 + 2 J).
            target: (B, J) [rad] that the servos are given for this control step.
            before: (B, P J) [rad] that they were given before it, the last one first; commands may be late.
            context: (B, C).
        """
        return moved(body, self.layers(self.normalised(body, target, before, context)) * self.scale, self.dt)

    def frozen(self) -> "Dynamics":
        """A twin on the same numbers from now on, whose weights want no gradient; compiled code would compute it."""
        twin = deepcopy(self)
        for own, other in zip(self.modules(), twin.modules(), strict=True):
            other._buffers.update(own._buffers)
        for weight, shared in zip(self.parameters(), twin.parameters(), strict=True):
            shared.requires_grad_(False).data = weight.data
        return twin

    @torch.no_grad()
    def normalise(
        self, body: Tensor, target: Tensor, before: Tensor, context: Tensor, after: Tensor, ranks: Ranks | None = None
    ) -> None:
        """Take the spreads of inputs and changes from first transitions (B, ...) of all ranks, none of them broken."""
        ranks = ranks or Ranks()
        mean, std = ranks.moments(self.seen(body, target, before, context))
        about, spread = ranks.moments(change_of(body, after, self.dt))
        self.mean.copy_(mean)
        self.std.copy_(std.clamp(min=1e-2))
        self.scale.copy_((about.square() + spread.square()).sqrt().clamp(min=1e-5))

    def unrolled(
        self, body: Tensor, targets: Tensor, before: Tensor, context: Tensor, step: Predict | None = None
    ) -> Tensor:
        """Predictions in a row, each from the last: (K, B, 13 + 2 J).

        Args:
            body: (B, 13 + 2 J) at first.
            targets: (K, B, J) [rad].
            before: (B, P J) [rad] before the first.
            context: (B, C).
            step: what predicts in place of `forward`, a compiled one.
        """
        states, body = [], body.requires_grad_()  # as later steps': compiled once
        for target in targets.unbind():
            body = (step or self)(body, target, before, context)
            before = handed_on(target, before)
            states.append(body)
        return torch.stack(states)

    def loss(self, predicted: Tensor, true: Tensor, valid: Tensor) -> Tensor:
        """Mean Huber loss of the differences in units of `spread`, in the true root's frame.

        Args:
            predicted: (K, B, 13 + 2 J).
            true: (K, B, 13 + 2 J).
            valid: (K, B) bool, steps before an episode's end.
        """
        error = difference(predicted, true) / self.spread
        cost = torch.nn.functional.smooth_l1_loss(error, torch.zeros_like(error), reduction="none", beta=0.3).mean(-1)
        return torch.where(valid, cost, 0.0).sum() / valid.sum().clamp(min=1)
