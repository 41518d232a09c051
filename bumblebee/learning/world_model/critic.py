"""The value of a state under the policy: what is earned beyond the steps that are imagined.

Values are counted in the mean reward of a control step to come, (1 - gamma) times the discounted sum, so that they are
of the size of a reward whatever the discount. A failure earns nothing after it. A clip's end is no failure: as in PPO,
the value of the step before it stands for what would follow. So the value is PPO's critic but for a factor, and either
learner goes on from the other's.
"""

from collections.abc import Mapping, Sequence
from copy import deepcopy

import torch
from rsl_rl.modules import MLP, EmpiricalNormalization
from torch import Tensor, nn

from bumblebee.learning.world_model.imagination import Rollout


class Critic(nn.Module):
    """A network of the value, and a slow average of it that the targets are made of.

    Args:
        observation: V, entries of what it sees: the first of what PPO's critic sees.
        whole: entries of what PPO's critic sees, V at least.
        hidden: widths of the layers, ELU.
    """

    def __init__(self, observation: int, whole: int, hidden: Sequence[int]) -> None:
        super().__init__()
        self.network = MLP(observation, 1, list(hidden), "elu")
        with torch.no_grad():  # values, and the gradient that they give the policy, begin at zero
            self.network[-1].weight.zero_()
            self.network[-1].bias.zero_()
        self.average = deepcopy(self.network).requires_grad_(False)
        self.normalizer = EmpiricalNormalization(whole).eval()
        self._seen = observation

    def normalised(self, seen: Tensor) -> Tensor:
        """Observations (..., V) in units of their spread."""
        mean, std = (tensor[0, : self._seen] for tensor in (self.normalizer._mean, self.normalizer._std))
        return (seen - mean) / (std + self.normalizer.eps)

    def forward(self, seen: Tensor) -> Tensor:
        """Values (...) of normalised observations (..., V), by the network that learns."""
        return self.network(seen).squeeze(-1)

    def steady(self, seen: Tensor) -> Tensor:
        """Values (...) of normalised observations (..., V), by the average."""
        return self.average(seen).squeeze(-1)

    def follow(self, share: float) -> None:
        """Move the average by this share of the way to the network."""
        torch._foreach_lerp_(list(self.average.parameters()), list(self.network.parameters()), share)

    def to_ppo(self, factor: float) -> dict[str, Tensor]:
        """The state of rsl_rl's critic that values a state `factor` times as high, whatever it sees beside."""
        layers = self.average.state_dict()
        first, last = "0.weight", f"{len(self.average) - 1}"
        layers[first] = nn.functional.pad(layers[first], (0, self.normalizer._mean.shape[1] - self._seen))
        for name in (f"{last}.weight", f"{last}.bias"):
            layers[name] = factor * layers[name]
        normalizer = self.normalizer.state_dict()
        state = {f"obs_normalizer.{n}": v for n, v in normalizer.items()} | {f"mlp.{n}": v for n, v in layers.items()}
        return {name: value.detach().cpu().clone() for name, value in state.items()}

    def from_ppo(self, state: Mapping[str, Tensor], factor: float) -> None:
        """Begin as such a critic, for which what it sees beside is at its mean."""
        layers = {name.removeprefix("mlp."): value for name, value in state.items() if name.startswith("mlp.")}
        last = f"{len(self.network) - 1}"
        layers |= {name: layers[name] / factor for name in (f"{last}.weight", f"{last}.bias")}
        layers["0.weight"] = layers["0.weight"][:, : self._seen]
        normalizer = {n.removeprefix("obs_normalizer."): v for n, v in state.items() if n.startswith("obs_normalizer.")}
        for network in (self.network, self.average):
            network.load_state_dict(layers)
        self.normalizer.load_state_dict(normalizer)


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
