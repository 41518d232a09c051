"""Time stamps of a log as its map says: rows in order, takes told apart, and a rate that a control loop can have."""

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.measured.importers.column_map import SECONDS, ColumnMap
from bumblebee.measured.pauses import SHORTEST, parts_between, pauses

SPLIT = "`episodes: split` in the map reads each as a rollout of its own"
_SLOWEST, _FASTEST = 0.99, 2e4  # Hz; rows once a second tell nothing of a motion, and no bus of drives is faster
_USUAL = (5.0, 5e3)  # Hz of logs; what another unit must lead to before it is named


def restarts(stamps: np.ndarray) -> list[int]:
    """Rows of (T,) stamps at which time starts again: at least two in a row are older than one before them.

    One alone is a row that came late.
    """
    found, high, before = [], -np.inf, 0
    with np.errstate(all="ignore"):  # stamps without a number are a finding of the checks
        for row in (np.flatnonzero(np.diff(stamps) < 0) + 1).tolist():
            high = max(high, stamps[before:row].max())
            before = row
            if row + 1 < len(stamps) and stamps[row + 1] < high:
                found.append(row)
                high = -np.inf
    return found


def takes(time: np.ndarray) -> list[slice]:
    """The rows of each take of (T,) stamps [s]: cut where time starts again, and at pauses that the checks refuse."""
    return parts_between(time, [*restarts(time), *pauses(time)])


def require_clock(where: str, time: np.ndarray, chosen: ColumnMap) -> None:
    """Refuse stamps (T,) [s] that step back or stand still, or whose rate says that they have another unit.

    Raises:
        BadInput: with the unit that would fit, or how to read takes one below the other, where that would do.
    """
    if chosen.hz or chosen.clock or len(time) < 2:
        return  # no stamps in the file, or a recorder's, whose unit is known
    with np.errstate(all="ignore"):  # stamps without a number are a finding of the checks
        steps = np.diff(time)
    place = f"{where}: {', '.join(chosen.time)}"
    if (steps < 0).any():
        raise _stepped_back(place, time, steps)
    period = float(np.median(steps))
    if period == 0:
        came = f"the stamp of the row before in {int((steps == 0).sum())} of {len(time)} rows"
        raise BadInput(
            place, "stamps that grow from row to row", came, "Name the column of another clock under `time`."
        )
    if not np.isfinite(period) or _SLOWEST <= 1 / period <= _FASTEST:
        return
    do = "Two columns under `time` are whole seconds and nanoseconds; name one, with its time_unit, if they are others."
    if len(chosen.time) == 1:
        seconds = period / SECONDS[chosen.time_unit]
        fit = [unit for unit, factor in SECONDS.items() if _USUAL[0] <= 1 / (seconds * factor) <= _USUAL[1]]
        looks = " or ".join(f"`time_unit: {unit}` ({1 / (seconds * SECONDS[unit]):.4g} Hz)" for unit in fit)
        do = f"time_unit is {chosen.time_unit}: these look like {looks}." if fit else ""
    raise BadInput(place, f"a rate of 1 to {_FASTEST:g} Hz", f"{1 / period:.4g} Hz by the median period", do)


def _stepped_back(place: str, time: np.ndarray, steps: np.ndarray) -> BadInput:
    """Takes one below the other, or rows out of order."""
    again, parts = restarts(time), takes(time)
    if again and parts and all((steps[part.start : part.stop - 1] >= 0).all() for part in parts):
        row = again[0]
        came = f"time that starts again ({steps[row - 1]:.4g} s): {len(again) + 1} takes in one file"
        return BadInput(f"{place}, row {row}", "stamps that grow from row to row", came, f"{SPLIT}.")
    row = int(np.argmax(steps < 0)) + 1
    came = f"a step of {steps[row - 1]:.4g} s ({int((steps < 0).sum())} such rows)"
    do = f"Sort the rows by time, if they are of one recording; a part shorter than {SHORTEST:g} s is of no use."
    return BadInput(f"{place}, row {row}", "stamps that grow from row to row", came, do)
