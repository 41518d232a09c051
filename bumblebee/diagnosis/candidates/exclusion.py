"""Which candidates are out of the question beside those that were chosen: the same, or another name of the same."""

from collections.abc import Sequence

from bumblebee.diagnosis.candidates.candidate import Candidate
from bumblebee.diagnosis.candidates.traits import exclude


def is_chosen(c: Candidate, chosen: Sequence[Candidate]) -> bool:
    """Whether it is chosen, or something on its place that cannot be there as well."""
    there = {o.effect for o in chosen if o.where == c.where}
    return c.effect in there or any(exclude(c.effect, other) for other in there)


def is_like(c: Candidate, others: Sequence[Candidate]) -> bool:
    """Whether enough of the same kind on the same place are already there, in other shapes."""
    return sum((c.effect, c.where) == (o.effect, o.where) for o in others) >= c.limits.shapes
