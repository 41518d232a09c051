"""Joint fit of the chosen effects: Gauss-Newton on whitened residuals, with the nuisances as further parameters."""

from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np

from bumblebee.diagnosis.candidates import Candidate, effects_at
from bumblebee.diagnosis.residuals import Problem
from bumblebee.sim.effects import Effect


@dataclass(frozen=True, eq=False)
class Fit:
    """Chosen candidates with their parameters, those of all of them one after the other (P,)."""

    chosen: tuple[Candidate, ...]
    values: np.ndarray
    """(P,)."""
    nuisance: np.ndarray
    """(4 or 5,) coefficients."""
    residual: np.ndarray
    """(W, M) whitened, nuisances not yet taken out."""
    columns: np.ndarray
    """(P', W, M) change of the prediction for a change of `scales`, at the fit; P' parameters that are fitted."""
    cost: float

    @property
    def effects(self) -> list[Effect]:
        """The effects at their fitted values."""
        return effects_at(self.chosen, self.values)

    @property
    def slices(self) -> list[slice]:
        """Where each candidate's parameters stand in `values`."""
        ends = np.cumsum([len(c.nominal) for c in self.chosen]).tolist()
        return [slice(end - len(c.nominal), end) for c, end in zip(self.chosen, ends, strict=True)]

    @property
    def scales(self) -> np.ndarray:
        """(P,) changes that matter; 0 for a parameter that is not fitted."""
        return np.concatenate([c.scales for c in self.chosen]) if self.chosen else np.empty(0)

    def of(self, candidate: Candidate) -> np.ndarray:
        """Parameters of one of the chosen."""
        return self.values[self.slices[self.chosen.index(candidate)]]

    def without(self, gone: Collection[Candidate]) -> "Fit":
        """The other effects where they are, with their columns; residual, nuisances and cost are of all still."""
        stays = [c not in gone for c in self.chosen]
        parameters = np.repeat(stays, [len(c.nominal) for c in self.chosen]).astype(bool)
        columns = np.repeat(stays, [int(np.count_nonzero(c.scales)) for c in self.chosen]).astype(bool)
        return replace(
            self,
            chosen=tuple(c for c, stay in zip(self.chosen, stays, strict=True) if stay),
            values=self.values[parameters],
            columns=self.columns[columns],
        )

    def clean(self, problem: Problem) -> np.ndarray:
        """Residual without nuisances (W, M)."""
        return self.residual - np.tensordot(self.nuisance, problem.nuisance, axes=1)

    def power(self, problem: Problem) -> float:
        """Median chi-square by value of the windows, 1 for noise alone."""
        return typical_power(self.clean(problem))


def typical_power(residual: np.ndarray) -> float:
    """Median over windows of the mean square of a whitened residual (W, M)."""
    return float(np.median((residual**2).mean(axis=1)))
