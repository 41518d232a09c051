"""In what the worlds differ, as a vector for each: what the model is told beside the state."""

from collections.abc import Mapping

import mujoco
import numpy as np
import torch
from torch import Tensor

from bumblebee.learning.ranks import Ranks


def context_of(
    model: mujoco.MjModel, values: Mapping[str, np.ndarray], worlds: int, ranks: Ranks | None = None
) -> Tensor:
    """Columns (N, C) of zero mean and unit spread over all ranks, one for each number that differs between worlds.

    A column means one thing, whatever was drawn: a model is learned by ranks with other worlds, and outlives its own.

    Args:
        model: the declared model.
        values: fields of it that differ, name -> (N, ...), as `randomise_worlds` gives them to the engine.
        worlds: N.
        ranks: the processes that learn one model together, with N worlds each.
    """
    columns = [np.zeros((worlds, 0))]
    for name, each in values.items():
        flat, declared = each.reshape(len(each), -1), np.asarray(getattr(model, name)).ravel()
        columns.append(np.divide(flat, declared, out=flat.astype(float), where=declared != 0))
    every = np.concatenate(columns, axis=1)
    spread = every.std(0)
    every, spread = every[:, spread > 1e-9], spread[spread > 1e-9]
    unit = (every - every.mean(0)) / spread
    again = np.triu(unit.T @ unit > (1 - 1e-9) * worlds, 1).any(0)  # one factor on several fields: the first one tells
    distinct = torch.from_numpy(every[:, ~again])
    mean, std = (ranks or Ranks()).moments(distinct)
    return ((distinct - mean) / std).float()
