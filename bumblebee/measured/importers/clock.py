"""Time stamps of a log as its map says: rows in order, and a rate that a control loop can have."""

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.measured.importers.column_map import SECONDS, ColumnMap

_SLOWEST, _FASTEST = 0.99, 2e4  # Hz; rows once a second tell nothing of a motion, and no bus of drives is faster
_USUAL = (5.0, 5e3)  # Hz of logs; what another unit must lead to before it is named


def require_clock(where: str, time: np.ndarray, chosen: ColumnMap) -> None:
    """Refuse stamps (T,) [s] that step back, or whose rate says that they have another unit.

    Raises:
        BadInput: with the unit that would fit, where one does.
    """
    if chosen.hz or chosen.clock or len(time) < 2:
        return  # no stamps in the file, or a recorder's, whose unit is known
    with np.errstate(all="ignore"):  # stamps without a number are a finding of the checks
        steps = np.diff(time)
    place = f"{where}: {', '.join(chosen.time)}"
    if (steps < 0).any():
        row = int(np.argmax(steps < 0)) + 1
        do = "Sort the rows; recordings one below the other are told apart by `episode`, a column that numbers them."
        came = f"a step of {steps[row - 1]:.4g} s ({int((steps < 0).sum())} such rows)"
        raise BadInput(f"{place}, row {row}", "stamps that grow from row to row", came, do)
    period = float(np.median(steps))
    if not np.isfinite(period) or period <= 0 or _SLOWEST <= 1 / period <= _FASTEST:
        return
    do = "They are whole seconds and nanoseconds, as `time` names two columns."
    if len(chosen.time) == 1:
        seconds = period / SECONDS[chosen.time_unit]
        fit = [unit for unit, factor in SECONDS.items() if _USUAL[0] <= 1 / (seconds * factor) <= _USUAL[1]]
        looks = " or ".join(f"{unit} ({1 / (seconds * SECONDS[unit]):.4g} Hz)" for unit in fit)
        do = f"time_unit is {chosen.time_unit}: " + (f"these look like {looks}." if fit else "state the stamps' unit.")
    raise BadInput(place, f"a rate of 1 to {_FASTEST:g} Hz", f"{1 / period:.4g} Hz by the median period", do)
