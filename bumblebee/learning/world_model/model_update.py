"""The model's update: it learns to predict what was seen."""

from typing import Any

import torch

from bumblebee.learning.ranks import Ranks
from bumblebee.learning.world_model.config import WorldModelConfig
from bumblebee.learning.world_model.descent import Descent, Learning
from bumblebee.learning.world_model.dynamics import Dynamics
from bumblebee.learning.world_model.memory import Memory

_FIRST = 65_536  # transitions that the model is normalised by


class ModelUpdate:
    """A gradient step of the model on windows of the memory; recorded on a GPU.

    Args:
        model: what learns.
        memory: full when this is called.
        config: batch, window and rate.
        ranks: the processes that learn one model together, each from its own memory.
    """

    def __init__(self, model: Dynamics, memory: Memory, config: WorldModelConfig, ranks: Ranks | None = None) -> None:
        self.model, self._memory, self._config, self._ranks = model, memory, config, ranks or Ranks()
        self._predict = torch.compile(model.forward, dynamic=False) if config.compile else model.forward
        self.descent = Descent(list(model.parameters()), config.model_rate, config.grad_norm)
        self.told = {"loss_model": torch.zeros((), device=model.mean.device), "gradient_model": self.descent.steepness}
        self._learn = Learning(self._differentiate, self.descent.step, [self.descent], self._ranks)

    def begin(self) -> None:
        """Normalise the model by the first full memory, and let it learn alone for a while."""
        window = self._memory.windows(1, _FIRST)
        columns = (window.bodies[0], window.targets[0], window.before, window.context, window.bodies[1])
        body, target, before, context, after = (column[window.valid[0]] for column in columns)
        self.model.normalise(body, target, before, context, after, self._ranks)
        for _ in range(self._config.warm_up):
            self()

    def __call__(self) -> None:
        """Learn once."""
        self._learn()

    def decay(self, done: float) -> None:
        """Set the learning rate for a training of which the share `done` lies behind."""
        self.descent.decay(done)

    def state_dict(self) -> dict[str, Any]:
        """The model and its optimiser."""
        return {"model": self.model.state_dict(), "descent": self.descent.state_dict()}

    def load_state_dict(self, saved: dict[str, Any]) -> None:
        """Go on from what `state_dict` gave."""
        self.model.load_state_dict(saved["model"])
        self.descent.load_state_dict(saved["descent"])

    def _differentiate(self) -> None:
        window = self._memory.windows(self._config.window, self._config.model_batch)
        first = (window.bodies[0], window.targets, window.before, window.context)
        predicted = self.model.unrolled(*first, self._predict)
        loss = self.model.loss(predicted, window.bodies[1:], window.valid)
        self.descent.differentiate(loss)
        self.told["loss_model"].copy_(loss.detach())
