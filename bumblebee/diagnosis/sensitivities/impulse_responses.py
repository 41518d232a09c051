"""How the readings of a window answer to a torque on each degree of freedom in each fifth of it.

Whatever acts as a torque along the path (friction, gains, delays, springs, masses ...) is to first order a sum of these
answers, weighted with its mean torque in each fifth. A few dozen simulations so stand for any number of candidates, and
the answers go through contacts and servos as the simulation does.
"""

from dataclasses import dataclass

import numpy as np
from mujoco.batch import Batch

from bumblebee.diagnosis.simulation import (
    Layout,
    Plant,
    Variation,
    Windows,
    activations,
    at_ticks,
    difference,
    inputs_of,
    out_of_reach,
    own_batch,
    simulated_readings,
    with_step,
    without,
)
from bumblebee.diagnosis.thresholds.sensitivities import Impulses

_STATE = ("qpos", "qvel", "act")


@dataclass(frozen=True, eq=False)
class Path:
    """Simulated windows: W windows, K steps, S segments of them."""

    step: float
    """[s]"""
    qpos: np.ndarray
    """(W, K + 1, nq), the start first."""
    qvel: np.ndarray
    """(W, K + 1, nv)."""
    control: np.ndarray
    """(W, K, nu)."""
    edges: np.ndarray
    """(S + 1,) steps at which the segments begin and end."""
    act: np.ndarray
    """(W, K + 1, na) activations of drives that have one."""

    def mean(self, values: np.ndarray) -> np.ndarray:
        """Means over the segments, (W, S, ...), of values at the steps (W, K, ...)."""
        return np.add.reduceat(values, self.edges[:-1], axis=1) / np.diff(self.edges).reshape(
            1, -1, *[1] * (values.ndim - 2)
        )


@dataclass(frozen=True, eq=False)
class Answers:
    """Path of the windows and the change of their readings for a unit of torque."""

    path: Path
    torque: np.ndarray
    """(nv, S, W, N, D) change of the readings for 1 N m (or N) on a degree of freedom during a segment."""


def answers_of(
    plant: Plant,
    layout: Layout,
    windows: Windows,
    variation: Variation,
    step: float,
    sizes: np.ndarray,
    only: np.ndarray | None = None,
    segments: int = Impulses.segments,
) -> Answers:
    """Simulate pulses of `sizes` (nv,) [N m, N] on every degree of freedom of a plain variation.

    With `only` on these alone, (some of nv,); the others' answers are left at zero.
    """
    pushed = np.arange(plant.model.nv) if only is None else only
    control, edges = commanded(windows, variation, step, segments)
    models, size = [with_step(model, step) for model in variation.models], len(windows)
    with without(models, out_of_reach(plant, windows)):  # a batch runs on a copy
        plain, batch = (own_batch(plant, windows, variation, copies) for copies in (1, len(pushed)))
    qpos = windows.qpos.copy()
    qpos[:, plant.qpos] -= variation.offset
    act = activations(windows, variation, control[:, 0])
    path = _free_path(plain, (qpos, windows.qvel, act), step, control, edges)

    def readings(q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray | None]:
        """(copies, W, N, D) from states at all steps (copies * W, K + 1, .)."""
        copies = len(q) // size
        at_q, at_v = (at_ticks(windows, x[:, 0].reshape(copies, size, -1), x[:, 1:], step, copies) for x in (q, v))
        return simulated_readings(plant, layout, at_q, at_v, variation.offset)

    base, base_quat = readings(path.qpos, path.qvel)
    change = np.zeros((plant.model.nv, len(edges) - 1, size, *base.shape[2:]))
    for s in range(len(edges) - 1):
        moved, moved_quat = readings(*_pushed_path(batch, path, np.diag(sizes)[pushed], s))
        same = None if base_quat is None or moved_quat is None else np.broadcast_to(base_quat, moved_quat.shape)
        change[pushed, s] = difference(layout, moved, moved_quat, np.broadcast_to(base, moved.shape), same)
    change /= sizes[:, None, None, None, None]
    return Answers(path, np.nan_to_num(change))


def commanded(windows: Windows, variation: Variation, step: float, segments: int) -> tuple[np.ndarray, np.ndarray]:
    """Controls (W, K, nu) of the windows' K steps, and the steps (S + 1,) at which segments begin and end."""
    count = max(1, int(np.ceil(windows.span / step - 1e-6)))
    edges = np.unique(np.linspace(0, count, min(segments, count) + 1).round().astype(int))
    return inputs_of(windows, variation, step, count, {}), edges


def _free_path(
    batch: Batch, start: tuple[np.ndarray, np.ndarray, np.ndarray], step: float, control: np.ndarray, edges: np.ndarray
) -> Path:
    """The windows as they go without a pulse, from a `start` of qpos (W, nq), qvel (W, nv) and activations (W, na)."""
    parts = [name for name, values in zip(_STATE, start, strict=True) if values.size]
    for name, values in zip(_STATE, start, strict=True):
        if values.size:
            batch.bind(name)[:] = values
    out = batch.rollout(control.shape[1], control, record=parts)
    whole = {
        name: np.concatenate((values[:, None], out[name]), axis=1) if values.size else values[:, None]
        for name, values in zip(_STATE, start, strict=True)
    }
    return Path(step=step, control=control, edges=edges, **whole)


def _pushed_path(batch: Batch, path: Path, torques: np.ndarray, segment: int) -> tuple[np.ndarray, np.ndarray]:
    """States (P * W, K + 1, .) under each of P torques (P, nv) during one segment, and as they go on after it."""
    first, last = path.edges[segment : segment + 2]
    many, (size, count) = len(torques), path.control.shape[:2]
    batch.reset(stage=0)
    batch.bind("qpos")[:] = np.tile(path.qpos[:, first], (many, 1))
    batch.bind("qvel")[:] = np.tile(path.qvel[:, first], (many, 1))
    if path.act.size:
        batch.bind("act")[:] = np.tile(path.act[:, first], (many, 1))
    push = np.repeat(torques, size, axis=0)
    q, v = (np.tile(x[:, : first + 1], (many, 1, 1)) for x in (path.qpos, path.qvel))
    for a, b, torque in ((first, last, push), (last, count, np.zeros_like(push))):
        if b > a:
            batch.bind("qfrc_applied")[:] = torque
            part = batch.rollout(b - a, np.tile(path.control[:, a:b], (many, 1, 1)), record=("qpos", "qvel"))
            q, v = np.concatenate((q, part["qpos"]), axis=1), np.concatenate((v, part["qvel"]), axis=1)
    return q, v
