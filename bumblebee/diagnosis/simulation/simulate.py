"""Many windows under many variations at once, on `mujoco.batch`."""

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from weakref import WeakKeyDictionary

import mujoco
import numpy as np
from mujoco.batch import Batch

from bumblebee.diagnosis.simulation.activations import activations
from bumblebee.diagnosis.simulation.actuator_history import read_at
from bumblebee.diagnosis.simulation.collision_culling import out_of_reach, without
from bumblebee.diagnosis.simulation.failures import REFUSALS
from bumblebee.diagnosis.simulation.hidden_states import Known, earlier, restructured, set_plastic, step_share
from bumblebee.diagnosis.simulation.plant import Plant
from bumblebee.diagnosis.simulation.readings import Layout, difference, simulated_readings
from bumblebee.diagnosis.simulation.roll import roll
from bumblebee.diagnosis.simulation.setpoints import follow
from bumblebee.diagnosis.simulation.stop import check
from bumblebee.diagnosis.simulation.variation import Variation
from bumblebee.diagnosis.simulation.windows import Windows, controls
from bumblebee.errors import BadInput
from bumblebee.quaternions import conjugate, from_rotation_vector, multiply, rotate_by_cross

THREADS: int | None = None
"""Threads of every simulation; None: see `threads`."""
_MOST_THREADS = 32
_CHUNK_BYTES = 48e6
_KEPT = 3  # controls of a set of windows that are kept: in most models the same ones arrive
_known: WeakKeyDictionary[Windows, dict[bytes, np.ndarray]] = WeakKeyDictionary()


@dataclass(frozen=True, eq=False)
class Starts:
    """Start states that replace the measured ones: qpos (K, W, nq), qvel (K, W, nv)."""

    qpos: np.ndarray
    qvel: np.ndarray

    def part(self, rows: range) -> "Starts":
        """Those of a stretch of the first axis."""
        return Starts(self.qpos[rows.start : rows.stop], self.qvel[rows.start : rows.stop])


def threads() -> int:
    """Threads for simulations: `THREADS`, or as many as the processors that this process may use."""
    if THREADS is not None:
        return THREADS
    allowed = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return min(allowed, _MOST_THREADS)


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
        together = _Chunk(plant, windows, chosen, own, short)
        out[part.start : part.stop] = _guarded(together, layout, cache, far)
        first = part.stop
    return out


def _guarded(chunk: "_Chunk", layout: Layout, cache: dict[bytes, np.ndarray], far: np.ndarray) -> np.ndarray:
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


def _simulated(chunk: "_Chunk", layout: Layout, cache: dict[bytes, np.ndarray], far: np.ndarray) -> np.ndarray:
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


def inputs_of(
    windows: Windows, variation: Variation, step: float, count: int, cache: dict[bytes, np.ndarray]
) -> np.ndarray:
    """Controls (W, count, nu) of a variation: late, shaped, and on the mean as held as dropped commands leave them."""
    share = variation.dropped
    shaped = variation.setpoints
    key = variation.delay.tobytes() + (b"" if share is None else share.tobytes())
    key += bytes(f"{count} {step!r} {shaped or ''}", "ascii")
    known = _known.setdefault(windows, {})
    if key in known:
        cache[key] = known[key]
    if key not in cache:
        sent = windows
        if share is not None:
            command = windows.command.copy()
            for k in range(1, command.shape[1]):
                command[:, k] = (1 - share) * command[:, k] + share * command[:, k - 1]
            sent = replace(windows, command=command)
        made = controls(sent, variation.delay, step, count)
        for point in shaped:
            made[..., point.actuator] = follow(sent, point, float(variation.delay[point.actuator]), step, count)
        known[key] = cache[key] = made
        if len(known) > _KEPT:
            known.pop(next(iter(known)))
    return cache[key]


@dataclass(frozen=True, eq=False)
class _Chunk:
    """Windows of a plant under some variations, or under one from some starts, that run in one batch."""

    plant: Plant
    windows: Windows
    chosen: list[Variation]
    starts: Starts | None
    """Starts of this chunk alone."""
    step: float
    """[s]"""

    @property
    def lead(self) -> Variation:
        """The first variation, which stands for all but in model, delay and offset."""
        return self.chosen[0]

    @property
    def own(self) -> Plant:
        """The plant of the simulated model."""
        return self.lead.plant or self.plant

    @property
    def offset(self) -> np.ndarray:
        """(V, 1, J) what encoders add [rad]."""
        return np.stack([v.offset for v in self.chosen])[:, None, :]

    def batch(self) -> Batch:
        """A batch of all windows under all variations, in the chunk's step."""
        for model in {id(m): m for v in self.chosen for m in v.models}.values():
            with_step(model, self.step)
        return batch_of(self.plant, self.windows, self.chosen)

    def begun(self, late: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Start states (V, W, nq), (V, W, nv) of the simulated model; encoders are `late` (J,) [s]."""
        plant, windows, lead = self.plant, self.windows, self.lead
        if self.starts is None:
            qpos = np.repeat(windows.qpos[None], len(self.chosen), axis=0)
            qvel = np.repeat(windows.qvel[None], len(self.chosen), axis=0)
        else:
            qpos, qvel = self.starts.qpos.copy(), self.starts.qvel
        qpos[..., plant.qpos] -= self.offset
        if late.any():
            qpos, qvel = _caught_up(plant, windows, qpos, qvel, late)
        if lead.tilt is not None:
            qpos, qvel = _righted(plant, qpos, qvel, lead.tilt)
        if lead.plant is not None:
            qpos, qvel = restructured(plant, windows, lead, qpos, qvel, _led_in(plant, windows, lead, self.step))
        return qpos, qvel


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


def _run(chunk: _Chunk, layout: Layout, inputs: list[np.ndarray]) -> np.ndarray:
    """Residuals (V, W, N, D) of one chunk under controls (W, count, nu) of each variation."""
    plant, windows, lead, own = chunk.plant, chunk.windows, chunk.lead, chunk.own
    copies, size = len(chunk.chosen), len(windows)
    batch, late = chunk.batch(), _late(plant, lead)
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


def _led_in(plant: Plant, windows: Windows, lead: Variation, step: float) -> Known | None:
    """State that a model with shafts has come to at the windows' starts."""
    if not any(kind == "series_elasticity" for kind, _, _ in lead.hidden):
        return None
    early, span, whole = earlier(plant, windows)
    early.qpos[:, plant.qpos] -= lead.offset
    qpos, qvel = restructured(plant, early, lead, early.qpos, early.qvel)
    batch = batch_of(plant, early, [lead])
    batch.bind("qpos")[:], batch.bind("qvel")[:] = qpos, qvel
    set_plastic(batch, plant, early, lead, 1)
    control = inputs_of(early, lead, step, max(1, round(span / step)), {})
    if lead.model.na:
        batch.bind("act")[:] = activations(early, lead, control[:, 0])
    path_q, path_v, failed = roll(batch, plant, early, [lead], control)
    return path_q[:, -1], path_v[:, -1], whole & ~failed


def _late(plant: Plant, lead: Variation) -> np.ndarray:
    """How old readings are when they are logged, (J,) [s]."""
    out = np.zeros(len(plant.joints))
    if lead.hooks is not None:
        out[[plant.joints.index(name) for name in lead.hooks.joints]] = lead.hooks.encoder_delay
    return out


def _caught_up(
    plant: Plant, windows: Windows, qpos: np.ndarray, qvel: np.ndarray, late: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Starts in which joints with late encoders are where a later reading puts them."""
    some, rule = np.flatnonzero(late), plant.thresholds.path
    moved, still = (read_at(windows, 0.0, delay, some, rule) for delay in (late[some], 0.0 * late[some]))
    qpos, qvel = qpos.copy(), qvel.copy()
    qpos[..., plant.qpos[some]] += moved[0] - still[0]
    qvel[..., plant.dof[some]] += moved[1] - still[1]
    return qpos, qvel


def _righted(plant: Plant, qpos: np.ndarray, qvel: np.ndarray, tilt: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Starts whose base stands as it is, not as a tilted sensor says; velocities in the base's frame stay."""
    qpos, qvel = qpos.copy(), qvel.copy()
    at, dof = slice(plant.base_qpos + 3, plant.base_qpos + 7), slice(plant.base_dof, plant.base_dof + 3)
    speed_b = rotate_by_cross(conjugate(qpos[..., at]), qvel[..., dof])
    qpos[..., at] = multiply(qpos[..., at], conjugate(from_rotation_vector(tilt)))
    qvel[..., dof] = rotate_by_cross(qpos[..., at], speed_b)
    return qpos, qvel


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
