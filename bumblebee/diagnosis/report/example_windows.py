"""Windows to look at: measured against the model before and after, in the joints and seconds where it matters."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from bumblebee.diagnosis.dataset import Session
from bumblebee.diagnosis.simulation import choose_starts, cut, residuals, vary
from bumblebee.diagnosis.thresholds.report import ExampleWindows
from bumblebee.sim.effects import Effect


def examples(
    session: Session, effects: Sequence[Effect] = (), count: int = 3, rule: ExampleWindows | None = None
) -> list[dict[str, Any]]:
    """One window each of the `count` joints where the effects matter most (without effects: where the model errs most).

    Each has rollout, start [s since the rollout's first stamp], joint, unit, time [s since the start], measured, target
    (position targets only), before and, with effects, after, all as lists over the window's ticks.
    """
    rule = rule or ExampleWindows()
    plant, layout, ids = session.plant, session.layout, session.holdout or session.train
    starts: list[tuple[int, int, int]] = []
    for length in rule.lengths:
        starts = starts or choose_starts(session.rollouts, ids, length, rule.windows, plant.thresholds.windows)
    windows = cut(plant, layout, session.rollouts, starts, outputs=rule.ticks)
    models = [vary(plant, [])] + ([vary(plant, effects)] if effects else [])
    left = residuals(plant, layout, windows, models, session.steps[0])[..., layout.slices["joint_pos"]]
    power = np.nan_to_num((left**2).mean(axis=2), nan=0.0, posinf=0.0)
    gain = power[0] - power[1] if effects else power[0]
    importance = np.sqrt(np.abs(np.median(gain, axis=0))) * np.sign(np.median(gain, axis=0))
    found = []
    for j in np.argsort(-importance)[:count]:
        order = np.argsort(gain[:, j])
        shown = int(order[int(rule.typical * (len(order) - 1))])
        found.append(_example(session, windows, left, shown, int(j)))
    return found


def _example(session: Session, windows: Any, left: np.ndarray, w: int, j: int) -> dict[str, Any]:
    plant = session.plant
    rollout = session.rollouts[windows.rollout[w]]
    start, time = int(windows.start[w]), windows.out_time[w]
    measured = windows.measured[w, :, session.layout.slices["joint_pos"]][..., j]
    # Differences of stamps: added to seconds since 1970, a nanosecond is lost.
    ticks = np.searchsorted(rollout.time - rollout.time[start], time + 1e-9) - 1
    entry = {
        "rollout": rollout.rollout_id,
        "start": float(rollout.time[start] - rollout.time[0]),
        "joint": plant.joints[j],
        "unit": unit_of(session, j),
        "time": time.tolist(),
        "measured": measured.tolist(),
        "before": _plain(measured - left[0, w, :, j]),
    }
    if not plant.torque_input and rollout.joint_target is not None:
        entry["target"] = rollout.joint_target[ticks, j].tolist()
    if len(left) > 1:
        entry["after"] = _plain(measured - left[1, w, :, j])
    return entry


def unit_of(session: Session, joint: int) -> str:
    """The unit of a joint's position: "m" for a slide."""
    kind = int(session.plant.model.jnt_type[session.plant.model.joint(session.plant.joints[joint]).id])
    return "m" if kind == 2 else "rad"


def _plain(values: np.ndarray) -> list[float | None]:
    """As a list whose values that are no numbers are None."""
    return [float(v) if np.isfinite(v) else None for v in values]
