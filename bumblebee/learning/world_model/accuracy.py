"""How well the model predicts worlds that it never learned from, by horizon, and whether it predicts at all."""

from dataclasses import dataclass

import torch
from torch import Tensor

from bumblebee.learning.ranks import Ranks
from bumblebee.learning.world_model.body import difference, moved
from bumblebee.learning.world_model.dynamics import Dynamics
from bumblebee.learning.world_model.memory import Memory, Windows

HORIZONS = (0.02, 0.2, 0.6)
"""Times [s] after a window's start at which predictions are compared with what happened."""


@dataclass(frozen=True)
class Accuracy:
    """Errors of a model on held-out worlds, of all ranks."""

    by_horizon: dict[str, float]
    """RMS errors `joints_mrad_0.2s` (all joints), `place_mm_0.2s` and `turn_mrad_0.2s` (the root), and so on; no
    horizon longer than the memory, and NaN where no episode in it is so long."""
    loss: float
    """Loss after one control step."""
    still: float
    """Loss after one control step of uniform motion, which predicts that nothing changes velocities."""


@torch.no_grad()
def accuracy(model: Dynamics, memory: Memory, ranks: Ranks | None = None) -> Accuracy:
    """Predict every window of the held-out worlds of a full memory.

    Args:
        model: what predicts.
        memory: full.
        ranks: the processes that learn this model together, each with its own memory.
    """
    ranks = ranks or Ranks()
    steps = {f"{seconds:g}s": round(seconds / model.dt) for seconds in HORIZONS}
    steps = {name: count for name, count in steps.items() if 0 < count < memory.steps}
    window = memory.held_out_windows(max(steps.values(), default=1))
    predicted = model.unrolled(window.bodies[0], window.targets, window.before, window.context)
    found: dict[str, float] = {}
    for name, count in steps.items():
        squares, windows = _squares(predicted, window, count, ranks)
        joints, place, turn = (1e3 * (squares / windows).sqrt()).tolist()
        found |= {f"joints_mrad_{name}": joints, f"place_mm_{name}": place, f"turn_mrad_{name}": turn}
    first, true, valid = window.bodies[:1], window.bodies[1:2], window.valid[:1]
    uniform = moved(first, torch.zeros_like(first[..., 1:]), model.dt)
    losses = {"loss": float(model.loss(predicted[:1], true, valid)), "still": float(model.loss(uniform, true, valid))}
    return Accuracy(found, **ranks.mean(losses, str(model.mean.device)))


def _squares(predicted: Tensor, window: Windows, count: int, ranks: Ranks) -> tuple[Tensor, float]:
    """Sums of squares (3,) of joints [rad^2], place [m^2] and turn [rad^2] after `count` steps, and windows."""
    error = difference(predicted[count - 1], window.bodies[count])[window.valid[count - 1]].double().square()
    joints = (error.shape[-1] - 12) // 2
    parts = (error[:, 12 : 12 + joints].mean(1), error[:, :3].sum(1), error[:, 3:6].sum(1))
    sums = torch.stack([part.sum() for part in parts] + [parts[0].new_tensor(float(len(error)))])
    ranks.add(sums)
    return sums[:3], float(sums[3])
