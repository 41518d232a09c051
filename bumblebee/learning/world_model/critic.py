"""The value of a state under the policy: what is earned beyond the steps that are imagined.

Values are counted in the mean reward of a control step to come, (1 - gamma) times the discounted sum, so that they are
of the size of a reward whatever the discount. A failure earns nothing after it. A clip's end is no failure: as in PPO,
the value of the step before it stands for what would follow.
"""

from collections.abc import Sequence
from copy import deepcopy

import torch
from rsl_rl.modules import MLP, EmpiricalNormalization
from torch import Tensor, nn

from bumblebee.learning.world_model.imagination import Rollout


class Critic(nn.Module):
    """A network of the value, and a slow average of it that the targets are made of.

    Args:
        observation: V, entries of what it sees.
        hidden: widths of the layers, ELU.
    """

    def __init__(self, observation: int, hidden: Sequence[int]) -> None:
        super().__init__()
        self.network = MLP(observation, 1, list(hidden), "elu")
        with torch.no_grad():  # values, and the gradient that they give the policy, begin at zero
            self.network[-1].weight.zero_()
            self.network[-1].bias.zero_()
        self.average = deepcopy(self.network).requires_grad_(False)
        self.normalizer = EmpiricalNormalization(observation).eval()

    def forward(self, seen: Tensor) -> Tensor:
        """Values (...) of normalised observations (..., V), by the network that learns."""
        return self.network(seen).squeeze(-1)

    def steady(self, seen: Tensor) -> Tensor:
        """Values (...) of normalised observations (..., V), by the average."""
        return self.average(seen).squeeze(-1)

    def follow(self, share: float) -> None:
        """Move the average by this share of the way to the network."""
        torch._foreach_lerp_(list(self.average.parameters()), list(self.network.parameters()), share)


def targets(rollout: Rollout, values: Tensor, gamma: float, trace: float) -> Tensor:
    """Values (H, B) to learn, by TD(lambda).

    Args:
        rollout: H imagined steps of B robots.
        values: (H + 1, B) before each step and after the last.
        gamma: discount a control step.
        trace: lambda, the weight of later rewards against the next value.
    """
    goes = rollout.alive[1:]
    at_once = torch.where(goes, (1 - trace) * values[1:], torch.where(rollout.over, values[:-1], 0.0))
    own, share = (1 - gamma) * rollout.reward + gamma * at_once, gamma * trace * goes
    found, coming = [], values[-1]
    for step in reversed(range(len(own))):
        coming = torch.addcmul(own[step], share[step], coming)
        found.append(coming)
    return torch.stack(found[::-1])


def objective(rollout: Rollout, last: Tensor, gamma: float) -> Tensor:
    """Mean discounted reward () of rollouts, with what comes after them; its gradient is the policy's.

    Args:
        rollout: H imagined steps of B robots.
        last: (B,) value after the last step.
        gamma: discount a control step, below 1.
    """
    horizon = len(rollout.reward)
    discount = gamma ** torch.arange(horizon, device=last.device)
    earned = (discount[:, None] * rollout.reward).sum(0)
    beyond = gamma**horizon / (1 - gamma) * torch.where(rollout.alive[-1], last, 0.0)
    return (earned + beyond).mean() / horizon


def error(rollout: Rollout, values: Tensor, wanted: Tensor) -> Tensor:
    """Mean square error () of values (H, B) before an end from those wanted (H, B)."""
    alive = rollout.alive[:-1]
    return torch.where(alive, (values - wanted).square(), 0.0).sum() / alive.sum().clamp(min=1)
