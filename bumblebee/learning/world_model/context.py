"""In what the worlds differ, as a vector for each: what the model is told beside the state."""

from collections.abc import Mapping

import mujoco
import numpy as np


def context_of(model: mujoco.MjModel, values: Mapping[str, np.ndarray], worlds: int) -> np.ndarray:
    """Columns (N, C) of zero mean and unit spread, one for each number that differs between worlds.

    Args:
        model: the declared model.
        values: fields of it that differ, name -> (N, ...), as `randomise_worlds` gives them to the engine.
        worlds: N.
    """
    columns = []
    for name, each in values.items():
        flat, declared = each.reshape(len(each), -1), np.asarray(getattr(model, name)).ravel()
        ratio = np.divide(flat, declared, out=flat.astype(float), where=declared != 0)
        columns.append(ratio)
    if not columns:
        return np.zeros((worlds, 0))
    every = np.concatenate(columns, axis=1)
    spread = every.std(0)
    every = ((every - every.mean(0)) / np.where(spread > 0, spread, 1.0))[:, spread > 1e-9]
    _, first = np.unique(every.round(6), axis=1, return_index=True)
    return every[:, np.sort(first)]  # in the model's order, whatever the draw: a model that goes on reads them alike
