"""Which candidates are out of the question beside those that were chosen: the same, or another name of the same."""

from collections.abc import Sequence

from bumblebee.diagnosis.candidates.candidate import Candidate
from bumblebee.sim.effects import SUFFIX

_SPRINGS = {"joint_spring", "asymmetric_friction"}


def is_chosen(c: Candidate, chosen: Sequence[Candidate]) -> bool:
    """Whether it is chosen, or something on its place that one spring of MJCF cannot be as well."""
    there = {o.effect for o in chosen if o.where == c.where}
    if c.effect in there or (c.effect in SUFFIX and there & set(SUFFIX)):
        return True
    return bool((c.effect == "hysteresis" and there & _SPRINGS) or (c.effect in _SPRINGS and "hysteresis" in there))


def is_like(c: Candidate, others: Sequence[Candidate]) -> bool:
    """Whether enough of the same kind on the same place are already there, in other shapes."""
    return sum((c.effect, c.where) == (o.effect, o.where) for o in others) >= c.limits.shapes
