"""Which candidates are worth a trial: not on a place that is taken, telling enough, free to move."""

from collections.abc import Sequence

import numpy as np

from bumblebee.diagnosis.candidates import Candidate
from bumblebee.diagnosis.scores import Scores
from bumblebee.sim.effect_native import SUFFIX

_SPRINGS = {"joint_spring", "asymmetric_friction"}
_MUCH = 0.15  # share of the cost
_PLAIN = 2.0  # times the chi-square of the bound


def is_chosen(c: Candidate, chosen: Sequence[Candidate]) -> bool:
    """Whether it is chosen, or something on its place that one spring of MJCF cannot be as well."""
    there = {o.effect for o in chosen if o.where == c.where}
    if c.effect in there or (c.effect in SUFFIX and there & set(SUFFIX)):
        return True
    return bool((c.effect == "hysteresis" and there & _SPRINGS) or (c.effect in _SPRINGS and "hysteresis" in there))


def is_like(c: Candidate, others: Sequence[Candidate]) -> bool:
    """Whether two of the same kind on the same place are already there, in other shapes."""
    return sum((c.effect, c.where) == (o.effect, o.where) for o in others) >= 2


def is_promising(c: Candidate, tests: Scores, k: int, bound: float, share: float, cost: float, power: float) -> bool:
    """Whether a candidate, number `k` of `tests`, is significant and can move the way it wants to.

    One that promises much of the whole cost is tried, too: where a few windows are very far off they decide its
    variance, and only the fit with it, in which they are not, can say how sure it is. So is one that gains much more
    than noise of the residual's `power` would give it, for the same reason. `bound` is the z to reach, `share` that of
    the windows the tests were made on, `cost` the fit's on all windows.
    """
    much = tests.gain[k] > min(_MUCH * share * cost, _PLAIN * max(power, 1.0) * bound**2)
    return bool(tests.z[k] >= bound or much) and any(_can_move(c, tests.steps[k]))


def _can_move(c: Candidate, steps: np.ndarray) -> list[bool]:
    """For each free parameter, whether the wanted change is not stopped by a bound."""
    wanted = np.array(c.nominal)
    wanted[list(c.free)] += np.asarray(steps) * np.array(c.step)[list(c.free)]
    reached = np.abs(c.clip(wanted) - np.array(c.nominal))
    return [bool(reached[i] > 1e-3 * abs(c.step[i])) for i in c.free]
