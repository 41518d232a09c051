"""Second look at what the screening promises, on as many other windows, before it is simulated on all.

Of a thousand candidates tens promise something on the screening's windows by noise alone. On as many windows again most
of them promise nothing, at a third of the cost of all windows. What was simulated there is not simulated again.

Which candidates are worth a trial: not on a place that is taken, telling enough, free to move.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bumblebee.diagnosis.candidates import Candidate, rough
from bumblebee.diagnosis.estimation import Fit
from bumblebee.diagnosis.residuals import Problem
from bumblebee.diagnosis.selection.score_tests import Scores, score_tests
from bumblebee.diagnosis.sensitivities import Columns
from bumblebee.diagnosis.simulation import Changes
from bumblebee.diagnosis.thresholds.selection import Screening
from bumblebee.sim.effects import Effect


class Stages:
    """The windows of a problem in two parts, or in one where they are few, and what was simulated on each."""

    def __init__(self, problem: Problem, keep: np.ndarray) -> None:
        """`keep` are the indices of the screening's windows."""
        every = np.arange(len(problem.windows))
        others = np.setdiff1d(every, keep)
        second = others[np.unique(np.linspace(0, len(others) - 1, min(len(keep), len(others))).round().astype(int))]
        twice = len(every) >= problem.thresholds.selection.screening.second_look * len(keep)
        self.both = np.concatenate((keep, second)) if twice else keep
        """Indices of the screening's windows and those of the second look, if there is one."""
        self._of = (problem.windows, problem.whitener)
        self._parts = (second, np.setdiff1d(every, second)) if twice else (every,)
        self._problems = [problem.part(part) for part in self._parts] if twice else [problem]
        self._known = [Changes().on(p.windows, p.whitener) for p in self._problems]

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


def restless(problem: Problem, answers: np.ndarray, residual: np.ndarray, count: int) -> list[str]:
    """Joints that lack most torque, worst first: where play and shafts are worth a simulation.

    `answers` (W, nv, S, M) to pulses explain the whitened residual (W, M), all degrees of freedom together; a joint's
    power is the mean square of its torques in their own standard errors, 1 for noise.
    """
    rule, size = problem.thresholds.selection.screening, answers.shape[1] * answers.shape[2]
    rows = answers.reshape(len(answers), size, -1).astype(float)
    scale = np.sqrt((rows**2).mean(axis=(0, 2), keepdims=True)) + 1e-12
    rows = rows / scale
    normal = np.matmul(rows, rows.transpose(0, 2, 1))
    normal[:, np.arange(size), np.arange(size)] += 1e-3 * normal.trace(axis1=1, axis2=2)[:, None] / size
    inverse = np.linalg.inv(normal)
    torque = np.matmul(inverse, np.matmul(rows, residual[:, :, None]))[..., 0]
    lacks = torque**2 / np.diagonal(inverse, axis1=1, axis2=2)
    power = lacks.reshape(len(answers), *answers.shape[1:3]).mean(axis=(0, 2))[problem.plant.dof]
    return [problem.plant.joints[j] for j in np.argsort(-power)[:count] if power[j] > rule.restless]


def is_promising(c: Candidate, tests: Scores, k: int, bound: float, fit: Fit, rule: Screening) -> bool:
    """Whether a candidate, number `k` of `tests`, is significant and can move the way it wants to.

    One that gains much more than noise of the residual's power would give it is tried, too: where a few windows are
    very far off they decide its variance, and only the fit with it, in which they are not, can say how sure it is.
    `bound` is the z to reach; `fit` is that of all windows.
    """
    power = fit.cost / fit.residual.size
    much = tests.gain[k] > rule.plain * max(power, 1.0) * bound**2
    return bool(tests.z[k] >= bound or much) and any(_can_move(c, tests.steps[k], rule.free))


def _can_move(c: Candidate, steps: np.ndarray, share: float) -> list[bool]:
    """For each free parameter, whether the wanted change is not stopped by a bound."""
    wanted = np.array(c.nominal)
    wanted[list(c.free)] += np.asarray(steps) * np.array(c.step)[list(c.free)]
    reached = np.abs(c.clip(wanted) - np.array(c.nominal))
    return [bool(reached[i] > share * abs(c.step[i])) for i in c.free]
