"""Statistics of the environment since someone last asked: the columns of a learning curve."""

import torch
from torch import Tensor

from bumblebee.tracking.rewards import Step, body_position

_MEANS = ("reward", "key_error", "joint_error", "velocity_error")


class Statistics:
    """Means over steps, and over the episodes that ended; summed on the device, and read by `take` alone.

    Args:
        device: where the steps' tensors are.
    """

    def __init__(self, device: torch.device | str = "cpu") -> None:
        # The means, steps, episodes ended, lost, unstable, and their lengths.
        self._sums = torch.zeros(len(_MEANS) + 5, dtype=torch.float64, device=device)

    def add(self, step: Step, rewards: Tensor, dones: Tensor, lost: Tensor, unstable: Tensor, length: Tensor) -> None:
        """Count one control step of all worlds; those that blew up have no errors that mean anything."""
        means = torch.stack((rewards, body_position(step), step.joint_error, step.velocity_error))
        counts = torch.stack((dones, lost, unstable)).sum(1)
        self._sums[: len(_MEANS)] += means.masked_fill(unstable, 0.0).mean(1)
        self._sums[len(_MEANS)] += 1
        self._sums[len(_MEANS) + 1 : -1] += counts
        self._sums[-1] += (length * dones).sum()

    @property
    def sums(self) -> Tensor:
        """Sums that `take` will read, to be added up over several environments first."""
        return self._sums

    def take(self) -> dict[str, float]:
        """The means since the last call: reward a step, episode length [steps], success, errors [m, rad, m/s]."""
        *means, steps, ended, lost, unstable, length = self._sums.tolist()
        self._sums.zero_()
        taken = {name: total / max(steps, 1.0) for name, total in zip(_MEANS, means, strict=True)}
        taken["episode_length"] = length / ended if ended else float("nan")
        taken["success"] = 1 - lost / ended if ended else float("nan")
        taken["unstable"] = unstable
        return taken
