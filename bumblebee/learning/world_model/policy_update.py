"""The policy's update: it learns to earn more in what the model imagines, and the value what comes after that."""

from copy import deepcopy
from typing import Any

import torch
from rsl_rl.models import MLPModel
from torch import Tensor

from bumblebee.learning.ranks import Ranks
from bumblebee.learning.world_model.config import WorldModelConfig
from bumblebee.learning.world_model.critic import Critic, error, objective, targets
from bumblebee.learning.world_model.descent import Descent, Learning
from bumblebee.learning.world_model.dynamics import Dynamics
from bumblebee.learning.world_model.imagination import Imagination
from bumblebee.learning.world_model.memory import Memory

_TOLD = ("imagined", "alive", "value", "loss_value")


class PolicyUpdate:
    """A gradient step of the policy through imagined rollouts, and one of the value on the same; recorded on a GPU.

    Args:
        actor: the policy.
        model: what imagines; frozen, see `Dynamics.frozen`.
        imagination: the task.
        memory: where rollouts begin; full when this is called.
        config: batch, horizon, discount and rates.
        ranks: the processes that learn one policy together.
    """

    def __init__(
        self,
        actor: MLPModel,
        model: Dynamics,
        imagination: Imagination,
        memory: Memory,
        config: WorldModelConfig,
        ranks: Ranks | None = None,
    ) -> None:
        device = model.mean.device
        self.actor, self.average = actor, deepcopy(actor).requires_grad_(False)
        self.critic = Critic(actor.obs_dim, config.value_hidden).to(device)
        self._seen = deepcopy(actor.obs_normalizer).train()
        self._model, self._imagination, self._memory, self._config = model, imagination, memory, config
        self.descents = {
            "policy": Descent(list(actor.mlp.parameters()), config.policy_rate, config.grad_norm),
            "value": Descent(list(self.critic.network.parameters()), config.value_rate, config.grad_norm),
        }
        self.told = {name: torch.zeros((), device=device) for name in _TOLD}
        self.told |= {f"gradient_{name}": descent.steepness for name, descent in self.descents.items()}
        self._learn = Learning(self._differentiate, self._apply, list(self.descents.values()), ranks or Ranks())

    def __call__(self) -> None:
        """Learn once."""
        self._learn()

    def look(self, seen: Tensor) -> None:
        """Normalise by these observations (N, D) too, in tensors that stay where they are."""
        self._seen.update(seen)
        for network in (self.actor, self.average):
            network.obs_normalizer.load_state_dict(self._seen.state_dict())

    def decay(self, done: float) -> None:
        """Set the learning rates for a training of which the share `done` lies behind."""
        for descent in self.descents.values():
            descent.decay(done)

    def state_dict(self) -> dict[str, Any]:
        """The networks and their optimisers."""
        kept = {name: getattr(self, name).state_dict() for name in ("actor", "average", "critic")}
        return kept | {"descents": {name: descent.state_dict() for name, descent in self.descents.items()}}

    def load_state_dict(self, saved: dict[str, Any]) -> None:
        """Go on from what `state_dict` gave."""
        for name in ("actor", "average", "critic"):
            getattr(self, name).load_state_dict(saved[name])
        for name, descent in self.descents.items():
            descent.load_state_dict(saved["descents"][name])
        self._seen.load_state_dict(self.actor.obs_normalizer.state_dict())

    def _differentiate(self) -> None:
        """Gradients of both networks; the value's depends on the policy by what was imagined alone."""
        config = self._config
        rollout = self._imagination.rollout(self._act, self._model, self._memory.starts(config.policy_batch))
        seen, after = self.actor.obs_normalizer(rollout.seen), self.actor.obs_normalizer(rollout.after)
        last = self.critic.steady(after)
        self.descents["policy"].differentiate(-objective(rollout, last, config.gamma))
        with torch.no_grad():
            values = torch.cat((self.critic.steady(seen), last[None]))
            wanted = targets(rollout, values, config.gamma, config.trace)
        loss = error(rollout, self.critic(seen), wanted)
        self.descents["value"].differentiate(loss)
        alive = rollout.alive[:-1].float().mean()
        found = (rollout.reward.mean(), alive, wanted.mean(), loss)
        for name, value in zip(_TOLD, found, strict=True):
            self.told[name].copy_(value.detach())

    def _apply(self) -> None:
        """A step of both networks; their averages follow."""
        for descent in self.descents.values():
            descent.step()
        own, kept = (list(network.mlp.parameters()) for network in (self.actor, self.average))
        torch._foreach_lerp_(kept, own, 1 - self._config.average)
        self.critic.follow(1 - self._config.value_average)

    def _act(self, seen: Tensor) -> Tensor:
        """Mean actions (B, J) of the policy that learns."""
        return self.actor({"policy": seen})
