"""PPO's update without a look at the device in between, each gradient step one CUDA graph where there is a GPU.

rsl_rl's own update asks the device for four numbers a gradient step (three losses and the KL divergence), so that the
GPU waits for hundreds of launches each time. Here the divergence decides on the learning rate where it is, and all
numbers are read once, at the end. On several GPUs the forward and backward pass is recorded, and what follows the
exchange of the gradients is not.
"""

from collections.abc import Iterator
from itertools import chain

import torch
from rsl_rl.algorithms import PPO
from rsl_rl.modules import EmpiricalNormalization
from torch import Tensor, nn
from torch import distributed as dist

from bumblebee.learning.ppo.update_graph import Recorded
from bumblebee.learning.ppo.update_step import gathered, losses, next_rate

TOLD = ("value", "surrogate", "entropy", "symmetry")


def cannot(algorithm: PPO) -> str | None:
    """Setting of this algorithm that this update has not got, or None."""
    symmetry = algorithm.symmetry
    lacking = {
        "a recurrent network": algorithm.actor.is_recurrent or algorithm.critic.is_recurrent,
        "an actor without a distribution": algorithm.actor.distribution is None,
        "random network distillation": algorithm.rnd is not None,
        "mixed precision": algorithm.use_mixed_precision,
        "advantages normalised by mini-batch": algorithm.normalize_advantage_per_mini_batch,
        "a value loss without clipping": not algorithm.use_clipped_value_loss,
        "another symmetry than augmentation": symmetry is not None
        and (symmetry.use_mirror_loss or not symmetry.use_data_augmentation),
        "an adaptive rate without a target": algorithm.schedule == "adaptive" and algorithm.desired_kl is None,
        "another optimiser than Adam": type(algorithm.optimizer) is not torch.optim.Adam,
    }
    return next((name for name, true in lacking.items() if true), None)


class DeviceUpdate:
    """The update of `algorithm`, whose optimiser it replaces by one whose learning rate is a tensor.

    Args:
        algorithm: rsl_rl's PPO, as `cannot` allows it; its networks stay where they are.
        bounds: of the adaptive learning rate.
    """

    def __init__(self, algorithm: PPO, bounds: tuple[float, float]) -> None:
        self._algorithm, self._bounds, device = algorithm, bounds, torch.device(algorithm.device)
        self._adaptive = algorithm.schedule == "adaptive"
        on_gpu = device.type == "cuda"
        self.rate = torch.tensor(algorithm.learning_rate, dtype=torch.float64, device=device)
        # Adam's fused kernel reads single precision; on a CPU it is given the rate as it is.
        self._adam_rate = self.rate.to(torch.float32 if on_gpu else torch.float64, copy=True)
        parameters, fused = chain(algorithm.actor.parameters(), algorithm.critic.parameters()), True if on_gpu else None
        algorithm.optimizer = torch.optim.Adam(parameters, lr=algorithm.learning_rate, capturable=on_gpu, fused=fused)
        self.attach_rate()
        self._target = torch.zeros((), device=device), torch.zeros((), device=device)
        self._kl = torch.zeros((), device=device)
        self._sums = torch.zeros(4 if algorithm.symmetry else 3, dtype=torch.float64, device=device)
        storage = algorithm.storage
        samples = storage.num_envs * storage.num_transitions_per_env
        self._size = samples // algorithm.num_mini_batches
        self._rows = torch.zeros(self._size, dtype=torch.long, device=device)
        self._advantages = torch.zeros(samples, 1, device=device)
        self._step = Recorded(self._differentiate if algorithm.is_multi_gpu else self._whole, device, self._uses)

    def __call__(self) -> dict[str, float]:
        """All epochs over what is stored, the normalisation and the losses' means; the storage is empty afterwards."""
        algorithm = self._algorithm
        self._sums.zero_()
        for tensor, factor in zip(self._target, (0.5, 2.0), strict=True):
            tensor.fill_(factor * algorithm.desired_kl if self._adaptive else 0.0)
        self._advantages.copy_(algorithm.storage.advantages.flatten(0, 1))
        order = torch.randperm(algorithm.num_mini_batches * self._size, device=self._rows.device)
        self._step.renew()
        for _ in range(algorithm.num_learning_epochs):
            for rows in order.split(self._size):
                self._rows.copy_(rows)
                self._step()
                if algorithm.is_multi_gpu:
                    self._exchange()
                    self._apply()
        self._normalise()
        algorithm.storage.clear()
        steps = algorithm.num_learning_epochs * algorithm.num_mini_batches
        *sums, rate = torch.cat((self._sums, self.rate[None])).tolist()
        algorithm.learning_rate = rate
        return {name: total / steps for name, total in zip(TOLD, sums, strict=False)}

    def attach_rate(self) -> None:
        """Let the optimiser have this update's learning rate; a state that is loaded into it brings its own."""
        for group in self._algorithm.optimizer.param_groups:
            group["lr"] = self._adam_rate

    def _whole(self) -> None:
        self._differentiate()
        self._apply()

    def _differentiate(self) -> None:
        """Gradients of the mini-batch `_rows`; its divergence and losses."""
        algorithm = self._algorithm
        algorithm.optimizer.zero_grad()
        found = losses(algorithm, gathered(algorithm.storage, self._advantages, self._rows))
        found.total.backward()
        self._sums += torch.stack(found.told)
        if found.kl is not None:
            self._kl.copy_(found.kl)

    def _exchange(self) -> None:
        """Means over all processes; equal to the bit on all of them, and so are the rates that follow."""
        algorithm = self._algorithm
        algorithm.reduce_parameters()
        if self._adaptive:
            dist.all_reduce(self._kl)
            self._kl /= algorithm.gpu_world_size

    def _apply(self) -> None:
        """One step of Adam with clipped gradients, at the rate that the divergence asks for."""
        algorithm = self._algorithm
        if self._adaptive:
            self.rate.copy_(next_rate(self.rate, self._kl, self._target, self._bounds))
        self._adam_rate.copy_(self.rate)
        nn.utils.clip_grad_norm_(algorithm.actor.parameters(), algorithm.max_grad_norm)
        nn.utils.clip_grad_norm_(algorithm.critic.parameters(), algorithm.max_grad_norm)
        algorithm.optimizer.step()

    def _normalise(self) -> None:
        """Update the observations' normalisation in place: rsl_rl puts a new tensor of deviations each time."""
        algorithm = self._algorithm
        seen = algorithm.storage.observations.flatten(0, 1)
        for model in (algorithm.actor, algorithm.critic):
            norm = model.obs_normalizer
            kept = norm._std if isinstance(norm, EmpiricalNormalization) else None
            model.update_normalization(seen)
            if kept is not None:
                kept.copy_(norm._std)
                norm._std = kept

    def _uses(self) -> Iterator[Tensor | None]:
        """Tensors that a recording depends on and others could replace."""
        algorithm, storage = self._algorithm, self._algorithm.storage
        yield from storage.observations.values()
        yield from (storage.actions, storage.values, storage.returns, storage.actions_log_prob)
        yield from storage.distribution_params or ()
        for model in (algorithm.actor, algorithm.critic):
            yield from model.state_dict(keep_vars=True).values()
            yield from (parameter.grad for parameter in model.parameters())
        for state in algorithm.optimizer.state.values():
            yield from state.values()
