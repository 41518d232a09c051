"""Which candidates are out of the question beside those that were chosen: the same, or another name of the same."""

from collections.abc import Sequence

from bumblebee.diagnosis.candidates.candidate import Candidate
from bumblebee.diagnosis.candidates.traits import exclude
from bumblebee.sim.effects import Effect


def is_chosen(c: Candidate, chosen: Sequence[Candidate]) -> bool:
    """Whether it is chosen, or something on its place that cannot be there as well."""
    there = {o.effect for o in chosen if o.where == c.where}
    return c.effect in there or any(exclude(c.effect, other) for other in there)


def is_like(c: Candidate, others: Sequence[Candidate]) -> bool:
    """Whether enough of the same kind on the same place are already there, in other shapes."""
    return sum((c.effect, c.where) == (o.effect, o.where) for o in others) >= c.limits.shapes


def possible_beside(effects: Sequence[Effect], c: Candidate) -> list[Effect]:
    """`effects` less those that the candidate's place cannot have as well.

    What a candidate changes is asked of all of them, for a swap step too: beside what it would replace no model has it.
    """
    return [e for e in effects if not (c.where in e.where and exclude(c.effect, e.effect))]
