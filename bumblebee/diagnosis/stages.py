"""What the screening promises, looked at again on as many other windows before it is simulated on all.

Of a thousand candidates tens promise something on the screening's windows by noise alone. On as many windows again most
of them promise nothing, at a third of the cost of all windows. What was simulated there is not simulated again.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bumblebee.diagnosis.candidates import Candidate
from bumblebee.diagnosis.changes import Changes
from bumblebee.diagnosis.fit import Fit
from bumblebee.diagnosis.problem import Problem, rough
from bumblebee.diagnosis.scores import Columns, Scores, score_tests
from bumblebee.sim.effects import Effect

_WORTH = 2.5  # times as many windows as are screened, from which on a second look is worth it


class Stages:
    """The windows of a problem in two parts, or in one where they are few, and what was simulated on each."""

    def __init__(self, problem: Problem, keep: np.ndarray) -> None:
        """`keep` are the indices of the screening's windows."""
        every = np.arange(len(problem.windows))
        others = np.setdiff1d(every, keep)
        second = others[np.unique(np.linspace(0, len(others) - 1, min(len(keep), len(others))).round().astype(int))]
        twice = len(every) >= _WORTH * len(keep)
        self.both = np.concatenate((keep, second)) if twice else keep
        """Indices of the screening's windows and those of the second look, if there is one."""
        self._of = (problem.windows, problem.whitener)
        self._parts = (second, np.setdiff1d(every, second)) if twice else (every,)
        self._problems = [problem.part(part) for part in self._parts] if twice else [problem]
        self._known = [Changes().on(p) for p in self._problems]

    def on(self, problem: Problem, keep: np.ndarray) -> "Stages":
        """These if they are of the problem's windows, else its own."""
        same = self._of[0] is problem.windows and self._of[1] is problem.whitener
        return self if same else Stages(problem, keep)

    def tests(
        self, problem: Problem, screened: Columns, looked: Sequence[Candidate], fit: Fit, weights: np.ndarray
    ) -> tuple[list[Candidate], Scores]:
        """Tests on `both` of those that are `looked` at and have been `screened`, and which these are."""
        known, values = [], [np.empty((0, len(self.both), fit.residual.shape[1]), dtype=np.float32)]
        for c, rows in zip(screened.candidates, screened.slices, strict=True):
            if len(self._parts) > 1 and c in looked:
                second = self._simulated(0, c, fit.effects)
                second = self._problems[0].tamed(second) if _coarse(c, fit.effects) else second
                values.append(np.concatenate((screened.values[rows], second), axis=1))
                known.append(c)
        own = replace(fit, residual=fit.residual[self.both], columns=fit.columns[:, self.both])
        some = replace(problem, nuisance=problem.nuisance[:, self.both])  # a test asks a problem for no more
        return known, score_tests(some, Columns(known, np.concatenate(values)), own, weights[self.both])

    def columns(self, problem: Problem, c: Candidate, effects: Sequence[Effect]) -> np.ndarray:
        """Columns (F, W, M) of a candidate beside `effects` on all windows of the problem."""
        parts = [self._simulated(k, c, effects) for k in range(len(self._parts))]
        out = np.empty((len(parts[0]), len(problem.windows), parts[0].shape[2]), dtype=np.float32)
        for part, values in zip(self._parts, parts, strict=True):
            out[:, part] = values
        return problem.tamed(out) if _coarse(c, effects) else out

    def _simulated(self, k: int, c: Candidate, effects: Sequence[Effect]) -> np.ndarray:
        """Columns on part `k`, as they were where nothing near has changed; no window of them tamed."""
        problem = self._problems[k]
        return self._known[k].get(effects, c.where, (c,), lambda: problem.sensitivities([c], effects, tame=False))


def _coarse(c: Candidate, effects: Sequence[Effect]) -> bool:
    return rough([*(e.effect for e in effects), c.effect])
