"""Many windows under many variations at once, on `mujoco.batch`."""

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from mujoco.batch import Batch

from bumblebee.diagnosis.plant import Plant
from bumblebee.diagnosis.signals import Layout, difference, simulated_readings
from bumblebee.diagnosis.variation import Variation
from bumblebee.diagnosis.windows import Windows, controls

THREADS = 2
_CHUNK_BYTES = 48e6


@dataclass(frozen=True, eq=False)
class Starts:
    """Start states that replace the measured ones: qpos (K, W, nq), qvel (K, W, nv)."""

    qpos: np.ndarray
    qvel: np.ndarray


def step_for(windows_period: float, longest: float) -> float:
    """The longest step not above `longest` of which a whole number fits the control period [s]."""
    return windows_period / max(1, int(np.ceil(windows_period / longest - 1e-9)))


def residuals(
    plant: Plant,
    layout: Layout,
    windows: Windows,
    variations: Sequence[Variation],
    step: float,
    starts: Starts | None = None,
) -> np.ndarray:
    """Return measured - simulated, (V, W, N, D); NaN where a simulation diverged.

    With `starts` of K start states, `variations` has one entry and the first axis is K.
    """
    copies = len(variations) if starts is None else len(starts.qpos)
    count = int(np.ceil(windows.span / step - 1e-6))
    width = plant.model.nq + plant.model.nv + plant.model.nu
    chunk = max(1, int(_CHUNK_BYTES / (8.0 * count * width * len(windows))))
    out = np.empty((copies, *windows.measured.shape))
    cache: dict[bytes, np.ndarray] = {}
    for first in range(0, copies, chunk):
        part = range(first, min(first + chunk, copies))
        chosen = [variations[0] if starts is not None else variations[v] for v in part]
        inputs = []
        for variation in chosen:
            key = variation.delay.tobytes()
            if key not in cache:
                cache[key] = controls(windows, variation.delay, step, count)
            inputs.append(cache[key])
        out[part.start : part.stop] = _run(plant, layout, windows, chosen, inputs, step, count, starts, part)
    return out


def _run(
    plant: Plant,
    layout: Layout,
    windows: Windows,
    chosen: list[Variation],
    inputs: list[np.ndarray],
    step: float,
    count: int,
    starts: Starts | None,
    part: range,
) -> np.ndarray:
    """One chunk: residuals (len(chosen), W, N, D)."""
    copies, size = len(chosen), len(windows)
    models = {id(v.model): _with_step(v.model, step) for v in chosen}
    batch = Batch(plant.model, copies * size, THREADS)
    batch.set_models([models[id(v.model)] for v in chosen for _ in range(size)])
    offset = np.stack([v.offset for v in chosen])[:, None, :]
    if starts is None:
        qpos = np.repeat(windows.qpos[None], copies, axis=0)
        qvel = np.repeat(windows.qvel[None], copies, axis=0)
    else:
        qpos, qvel = starts.qpos[part.start : part.stop].copy(), starts.qvel[part.start : part.stop]
    qpos[..., plant.qpos] -= offset
    batch.bind("qpos")[:] = qpos.reshape(copies * size, -1)
    batch.bind("qvel")[:] = qvel.reshape(copies * size, -1)
    control = np.stack(inputs).reshape(copies * size, count, -1)
    if plant.model.na:
        batch.bind("act")[:] = _activation(plant.model, control[:, 0])
    out = batch.rollout(count, control, record=("qpos", "qvel"))
    failed = batch.warning.reshape(copies * size, -1).any(axis=1)
    at_q = _at_ticks(windows, qpos, out["qpos"], step, copies)
    at_v = _at_ticks(windows, qvel, out["qvel"], step, copies)
    simulated, quat = simulated_readings(plant, layout, at_q, at_v, offset[:, :, None, :])
    measured = np.broadcast_to(windows.measured, simulated.shape)
    target = None if windows.quat is None else np.broadcast_to(windows.quat, quat.shape)
    result = difference(layout, measured, target, simulated, quat)
    result[failed.reshape(copies, size)] = np.nan
    return result


def _with_step(model: mujoco.MjModel, step: float) -> mujoco.MjModel:
    """The model itself, its step set: variations are never stepped from two places at once."""
    model.opt.timestep = step
    return model


def _activation(model: mujoco.MjModel, control: np.ndarray) -> np.ndarray:
    """Filters start at rest with their input: (n, na) from (n, nu)."""
    act = np.zeros((len(control), model.na))
    for a in range(model.nu):
        if model.actuator_actnum[a]:
            act[:, model.actuator_actadr[a]] = control[:, a]
    return act


def _at_ticks(windows: Windows, start: np.ndarray, path: np.ndarray, step: float, copies: int) -> np.ndarray:
    """States (copies, W, N, .) at the compared ticks, linear between simulation steps."""
    size = len(windows)
    path = path.reshape(copies, size, *path.shape[1:])
    at = windows.out_time / step
    low = np.clip(np.floor(at + 1e-6).astype(int), 0, path.shape[2])
    share = np.clip(at - low, 0.0, 1.0)
    share[share < 1e-5] = 0.0
    full = np.concatenate((start.reshape(copies, size, 1, -1), path), axis=2)
    rows = np.arange(size)[:, None]
    lower = full[:, rows, low]
    if not share.any():
        return lower
    upper = full[:, rows, np.minimum(low + 1, path.shape[2])]
    return lower + share[None, :, :, None] * (upper - lower)
