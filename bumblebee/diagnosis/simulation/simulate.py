"""Many windows under many variations at once, on `mujoco.batch`."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bumblebee.diagnosis.simulation.chunk import Chunk, Starts, lateness
from bumblebee.diagnosis.simulation.collision_culling import out_of_reach, without
from bumblebee.diagnosis.simulation.failures import REFUSALS
from bumblebee.diagnosis.simulation.inputs import inputs_of
from bumblebee.diagnosis.simulation.plant import Plant
from bumblebee.diagnosis.simulation.readings import Layout, difference, simulated_readings
from bumblebee.diagnosis.simulation.roll import roll
from bumblebee.diagnosis.simulation.starts.activations import activations
from bumblebee.diagnosis.simulation.starts.hidden_states import set_plastic, step_share
from bumblebee.diagnosis.simulation.stop import check
from bumblebee.diagnosis.simulation.variation import Variation
from bumblebee.diagnosis.simulation.windows import Windows
from bumblebee.errors import BadInput
from bumblebee.quaternions import from_rotation_vector, multiply

_CHUNK_BYTES = 48e6


def residuals(
    plant: Plant,
    layout: Layout,
    windows: Windows,
    variations: Sequence[Variation],
    step: float,
    starts: Starts | None = None,
) -> np.ndarray:
    """Return measured - simulated, (V, W, N, D); NaN where a simulation diverged or was not to be had.

    With `starts` of K start states, `variations` has one entry and the first axis is K.
    """
    copies = len(variations) if starts is None else len(starts.qpos)
    width = plant.model.nq + plant.model.nv + plant.model.nu
    chunk = max(1, int(_CHUNK_BYTES / (8.0 * np.ceil(windows.span / step - 1e-6) * width * len(windows))))
    out = np.empty((copies, *windows.measured.shape))
    cache: dict[bytes, np.ndarray] = {}
    far = out_of_reach(plant, windows)
    first = 0
    while first < copies:
        check()
        part = _together(variations, first, chunk) if starts is None else range(first, min(first + chunk, copies))
        chosen = [variations[0] if starts is not None else variations[v] for v in part]
        own = None if starts is None else starts.part(part)
        short = step * step_share(chosen[0].hidden, plant.thresholds.hidden)
        together = Chunk(plant, windows, chosen, own, short)
        out[part.start : part.stop] = _guarded(together, layout, cache, far)
        first = part.stop
    return out


def _guarded(chunk: Chunk, layout: Layout, cache: dict[bytes, np.ndarray], far: np.ndarray) -> np.ndarray:
    """Residuals (V, W, N, D) of one chunk; of a variation that cannot be simulated NaN, for it alone.

    The declared model is no trial: where it cannot be simulated, the input is unusable.
    """
    lead, nothing = chunk.lead, np.full((len(chunk.chosen), *chunk.windows.measured.shape), np.nan)
    if lead.impossible:
        return nothing
    try:
        return _simulated(chunk, layout, cache, far)
    except REFUSALS as error:
        if len(chunk.chosen) > 1 and chunk.starts is None:
            each = [_guarded(replace(chunk, chosen=[v]), layout, cache, far) for v in chunk.chosen]
            return np.concatenate(each)
        if not lead.effects:
            raise BadInput("declared model", "one that MuJoCo can simulate", " ".join(str(error).split())) from error
        chunk.plant.failures.add(lead.effects, error)
        return nothing


def _simulated(chunk: Chunk, layout: Layout, cache: dict[bytes, np.ndarray], far: np.ndarray) -> np.ndarray:
    """Residuals (V, W, N, D) of one chunk."""
    chosen, windows = chunk.chosen, chunk.windows
    count = int(np.ceil(windows.span / chunk.step - 1e-6))
    inputs = [inputs_of(windows, variation, chunk.step, count, cache) for variation in chosen]
    some = [] if chosen[0].plant is not None else [m for v in chosen for m in v.models]
    models = list({id(m): m for m in some}.values())
    with without(models, far):
        return _run(chunk, layout, inputs)


def _together(variations: Sequence[Variation], first: int, chunk: int) -> range:
    """Plain variations of one structure from `first` on run in one batch; one that is more than a model runs alone."""
    last = first
    while last < min(first + chunk, len(variations)) and variations[last].beside(variations[first]):
        last += 1
    return range(first, max(last, first + 1))


def _run(chunk: Chunk, layout: Layout, inputs: list[np.ndarray]) -> np.ndarray:
    """Residuals (V, W, N, D) of one chunk under controls (W, count, nu) of each variation."""
    plant, windows, lead, own = chunk.plant, chunk.windows, chunk.lead, chunk.own
    copies, size = len(chunk.chosen), len(windows)
    batch, late = chunk.batch(), lateness(plant, lead)
    qpos, qvel = chunk.begun(late)
    batch.bind("qpos")[:] = qpos.reshape(copies * size, -1)
    batch.bind("qvel")[:] = qvel.reshape(copies * size, -1)
    control = np.stack(inputs).reshape(copies * size, inputs[0].shape[1], -1)
    if own.model.na:
        batch.bind("act")[:] = np.concatenate(
            [activations(windows, v, given[:, 0]) for v, given in zip(chunk.chosen, inputs, strict=True)]
            if chunk.starts is None
            else [activations(windows, lead, inputs[0][:, 0])] * copies
        )
    set_plastic(batch, plant, windows, lead, copies)
    path_q, path_v, failed = roll(batch, plant, windows, chunk.chosen, control, once=chunk.starts is not None)
    at_q = at_ticks(windows, qpos, path_q, chunk.step, copies)
    at_v = at_ticks(windows, qvel, path_v, chunk.step, copies)
    for delay in np.unique(late[late > 0]):
        old = replace(windows, out_time=np.maximum(windows.out_time - delay, 0.0))
        for at, start, path, where in ((at_q, qpos, path_q, own.qpos), (at_v, qvel, path_v, own.dof)):
            columns = where[late == delay]
            at[..., columns] = at_ticks(old, start, path, chunk.step, copies)[..., columns]
    simulated, quat = simulated_readings(own, layout, at_q, at_v, chunk.offset[:, :, None, :])
    if quat is not None and lead.tilt is not None:
        quat = multiply(quat, from_rotation_vector(lead.tilt))
    measured = np.broadcast_to(windows.measured, simulated.shape)
    target = None if windows.quat is None or quat is None else np.broadcast_to(windows.quat, quat.shape)
    result = difference(layout, measured, target, simulated, quat)
    result[failed.reshape(copies, size)] = np.nan
    return result


def at_ticks(windows: Windows, start: np.ndarray, path: np.ndarray, step: float, copies: int) -> np.ndarray:
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
