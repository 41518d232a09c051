"""Recordings in parts: what lies before and after a pause of the log, of which no one knows the commands in it."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from bumblebee.measured.checks import Thresholds
from bumblebee.measured.rollout import Rollout

SHORTEST = 1.0
"""Seconds; a shorter part of a log is no rollout: it holds no window of the diagnosis' longest horizon."""


def pauses(time: np.ndarray) -> list[int]:
    """Rows of (T,) stamps [s] before which the log paused for longer than the checks let pass."""
    with np.errstate(all="ignore"):  # stamps without a number are a finding of the checks
        steps = np.diff(time)
        forward = steps[steps > 0]
        if not len(forward):
            return []
        return [int(row) + 1 for row in np.flatnonzero(steps > Thresholds().gap_fatal * np.median(forward))]


def parts_between(time: np.ndarray, edges: Iterable[int]) -> list[slice]:
    """The rows between `edges` of (T,) stamps [s], of parts that are long enough to be rollouts."""
    parts = [slice(first, last) for first, last in pairwise(sorted({0, *edges, len(time)}))]
    return [part for part in parts if part.stop - part.start > 1 and time[part.stop - 1] - time[part.start] >= SHORTEST]


def cut_at_pauses(rollout: Rollout) -> list[Rollout]:
    """The parts of a rollout as rollouts NAME_1, NAME_2, ...; the rollout itself where it has no pause or no part."""
    if not (np.diff(rollout.time) > 0).all():  # a clock that goes back is a finding of the checks
        return [rollout]
    rows = pauses(rollout.time)
    parts = parts_between(rollout.time, rows) if rows else []
    return [_part(rollout, rows, number) for number, rows in enumerate(parts, 1)] or [rollout]


def cut_note(cut: Sequence[tuple[str, Sequence[Rollout]]]) -> list[str]:
    """One note on (recording, its parts) of all that were cut."""
    if not cut:
        return []
    shown = "; ".join(f"{name} into {', '.join(part.rollout_id for part in parts)}" for name, parts in cut[:3])
    more = f"; and {len(cut) - 3} more" if len(cut) > 3 else ""
    longer = f"pauses of more than {Thresholds().gap_fatal:g} periods"
    return [f"cut at {longer}, parts shorter than {SHORTEST:g} s left out: {shown}{more}"]


def _part(rollout: Rollout, rows: slice, number: int) -> Rollout:
    name = f"{rollout.rollout_id}_{number}"
    values = {column: getattr(rollout, column)[rows] for column in ("time", *rollout.columns)}
    motion = {"motion": f"{rollout.meta['motion']}_{number}"} if rollout.meta.get("motion") else {}
    return replace(rollout, rollout_id=name, meta=rollout.meta | motion, **values)
