"""The policy's update: it learns to earn more in what the model imagines, and the value what comes after that."""

from collections.abc import Mapping
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
        whole = imagination.env.get_observations()["critic"].shape[1]
        self.critic = Critic(imagination.value_size, whole, config.hidden).to(device)
        self._seen, self._valued = (deepcopy(n).train() for n in (actor.obs_normalizer, self.critic.normalizer))
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

    def value_from(self, state: Mapping[str, Tensor], factor: float) -> None:
        """Begin with the value of rsl_rl's critic of that state, which is `factor` times as high."""
        self.critic.from_ppo(state, factor)
        self._valued.load_state_dict(self.critic.normalizer.state_dict())

    def look(self, seen: Tensor, exact: Tensor) -> None:
        """Normalise by these observations (N, D) too, and the value by a critic's (N, W), where the tensors are."""
        self._seen.update(seen)
        self._valued.update(exact)
        self.critic.normalizer.load_state_dict(self._valued.state_dict())
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
        self._valued.load_state_dict(self.critic.normalizer.state_dict())

    def _differentiate(self) -> None:
        """Gradients of both networks; the value's depends on the policy by what was imagined alone."""
        config = self._config
        rollout = self._imagination.rollout(self._act, self._model, self._memory.starts(config.policy_batch))
        seen, after = self.critic.normalised(rollout.seen), self.critic.normalised(rollout.after)
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
