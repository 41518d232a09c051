"""Controls that reach the drives under a variation: late, shaped, dropped."""

from dataclasses import replace
from weakref import WeakKeyDictionary

import numpy as np

from bumblebee.diagnosis.simulation.starts.setpoints import follow
from bumblebee.diagnosis.simulation.variation import Variation
from bumblebee.diagnosis.simulation.windows import Windows, controls

_KEPT = 3  # controls of a set of windows that are kept: in most models the same ones arrive
_known: WeakKeyDictionary[Windows, dict[bytes, np.ndarray]] = WeakKeyDictionary()


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
