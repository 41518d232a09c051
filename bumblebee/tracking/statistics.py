"""What happened in the environment since someone last asked: the columns of a learning curve."""

import torch
from torch import Tensor

from bumblebee.tracking.rewards import Step, body_position, dof_position, root_velocity


class Statistics:
    """Means over steps, and over the episodes that ended."""

    def __init__(self) -> None:
        self._clear()

    def _clear(self) -> None:
        self._sums: dict[str, float] = {}
        self._steps = 0
        self._ended = 0
        self._lost = 0
        self._unstable = 0
        self._length = 0.0

    def add(self, step: Step, rewards: Tensor, dones: Tensor, lost: Tensor, unstable: Tensor, length: Tensor) -> None:
        """Count one control step of all worlds."""
        means = {
            "reward": rewards.mean(),
            "key_error": torch.nan_to_num(body_position(step)).mean(),
            "joint_error": torch.nan_to_num(dof_position(step)).mean(),
            "velocity_error": torch.nan_to_num(root_velocity(step)).mean(),
        }
        for name, value in means.items():
            self._sums[name] = self._sums.get(name, 0.0) + float(value)
        self._steps += 1
        ended = int(dones.sum())
        self._ended += ended
        self._lost += int(lost.sum())
        self._unstable += int(unstable.sum())
        self._length += float(length[dones].sum())

    def take(self) -> dict[str, float]:
        """The means since the last call: reward a step, episode length [steps], success, errors [m, rad, m/s]."""
        steps, ended = max(self._steps, 1), self._ended
        taken = {name: total / steps for name, total in self._sums.items()}
        taken["episode_length"] = self._length / ended if ended else float("nan")
        taken["success"] = 1 - self._lost / ended if ended else float("nan")
        taken["unstable"] = float(self._unstable)
        self._clear()
        return taken
