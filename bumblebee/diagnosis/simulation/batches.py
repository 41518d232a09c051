"""Batches of MuJoCo's for windows under variations: in which models, on how many threads."""

import os
from collections.abc import Sequence

import mujoco
import numpy as np
from mujoco.batch import Batch

from bumblebee.diagnosis.simulation.plant import Plant
from bumblebee.diagnosis.simulation.variation import Variation
from bumblebee.diagnosis.simulation.windows import Windows

THREADS: int | None = None
"""Threads of every simulation; None: see `threads`."""
_MOST_THREADS = 32


def threads() -> int:
    """Threads for simulations: `THREADS`, or as many as the processors that this process may use."""
    if THREADS is not None:
        return THREADS
    allowed = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return min(allowed, _MOST_THREADS)


def batch_of(plant: Plant, windows: Windows, chosen: Sequence[Variation]) -> Batch:
    """A batch of all windows under each of the `chosen`, each window in the model of its condition."""
    lead = chosen[0]
    if lead.hooks is not None or not (lead.plain or lead.others):
        return own_batch(plant, windows, lead, len(chosen))
    batch = Batch(lead.model, len(chosen) * len(windows), threads())
    batch.set_models([v.models[c] for v in chosen for c in windows.condition])
    return batch


def own_batch(plant: Plant, windows: Windows, lead: Variation, copies: int) -> Batch:
    """A batch of copies of all windows with models of its own, as they are now, whose fields may be written."""
    batch = Batch(lead.model, copies * len(windows), threads())
    for name in plant.differing if lead.others else ():
        rows = np.stack([getattr(model, name) for model in lead.models])[np.tile(windows.condition, copies)]
        batch.expand(name)[:] = rows
    return batch


def with_step(model: mujoco.MjModel, step: float) -> mujoco.MjModel:
    """The model itself, its step set: variations are never stepped from two places at once.

    A robot is one island of constraints: looking for others costs a tenth of a step and changes nothing. Nobody reads
    sensors, and without shapes nothing touches.
    """
    off = mujoco.mjtDisableBit
    model.opt.timestep = step
    model.opt.disableflags |= int(off.mjDSBL_ISLAND) | int(off.mjDSBL_SENSOR)
    if not model.ngeom + model.nflex:
        model.opt.disableflags |= int(off.mjDSBL_CONTACT)
    return model
