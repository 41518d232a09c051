"""Context that the model is told beside the state: a vector of what differs for each world, and how far targets act."""

from collections.abc import Mapping

import mujoco
import numpy as np
import torch
from torch import Tensor

from bumblebee.learning.ranks import Ranks
from bumblebee.learning.world_model.dynamics import past_targets
from bumblebee.tracking.env import TrackingEnv
from bumblebee.tracking.worlds.randomisation import draw_fields


def context_in(env: TrackingEnv, ranks: Ranks | None = None) -> Tensor:
    """In what the worlds of `env` differ, (N, C), as its world model is told; see `context_of`."""
    drawn = draw_fields(env.engine.model, env.cfg.randomisation, env.num_envs, env.seed)
    return context_of(env.engine.model, drawn, env.num_envs, ranks).to(env.device)


def past_in(env: TrackingEnv) -> int:
    """How many earlier targets may still act on the robots of `env`, with the longest delay that is drawn."""
    delay = float(env.engine.model.actuator_delay.max()) + env.cfg.randomisation.delay[1]
    return past_targets(delay, env.dt)


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
