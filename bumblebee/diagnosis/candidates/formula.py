"""A candidate whose law is a sum of terms that were discovered, and not one of the catalogue."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bumblebee.diagnosis.candidates.candidate import Candidate
from bumblebee.sim.effects import Effect

DISCOVERED = "discovered"


@dataclass(frozen=True)
class Formula(Candidate):
    """Terms of `effects.terms` on one joint; parameters (P,) are their coefficients, absent at 0."""

    texts: tuple[str, ...] = ()

    def at(self, values: Sequence[float] | np.ndarray) -> Effect:
        """The effect with its coefficients at `values` (P,)."""
        return Effect(DISCOVERED, (self.where,), dict(zip(self.texts, map(float, values), strict=True)))

    def clip(self, values: Sequence[float] | np.ndarray) -> np.ndarray:
        """`values` as they are: a coefficient has no bounds."""
        return np.asarray(values, dtype=float)


def formula(joint: str, terms: dict[str, float]) -> Formula:
    """The candidate of `terms`, term -> coefficient that matters."""
    sizes = tuple(max(abs(x), 1e-9) for x in terms.values())
    return Formula(DISCOVERED, joint, (0.0,) * len(terms), sizes, tuple(range(len(terms))), texts=tuple(terms))
