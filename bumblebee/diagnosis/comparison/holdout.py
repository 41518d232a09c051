"""Whether an effect pays on windows that took no part in its fit, at 0.2 s and, where the data reach, at 1 s.

Near the truth an effect is looked for in its own direction, where nearly all of the noise is orthogonal to it. Far from
it gains are differences of log(1 + chi-square) by window, so that a few windows beside an unstable pose do not outvote
the rest.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy.stats import norm
from scipy.stats import t as student

from bumblebee.diagnosis.estimation import Fit
from bumblebee.diagnosis.residuals import Problem, nuisance_columns
from bumblebee.diagnosis.simulation import Recall, Windows, residuals, vary
from bumblebee.diagnosis.thresholds.comparison import Later
from bumblebee.sim.effects import Effect


@dataclass(frozen=True, eq=False)
class Holdout:
    """Validation windows that acceptance is decided on; without windows everything is accepted."""

    problem: Problem | None = None
    long: Windows | None = None
    """Windows of 1 s of these and of the fitted rollouts, their last tick compared."""
    last: Windows | None = None
    """More of these, on which the last fit must not be worse: one window in a hundred may be where it goes wrong."""
    recall: Recall = field(default_factory=Recall, repr=False)
    """Errors of models on the windows `long`, and on the windows `last`."""
    recall_last: Recall = field(default_factory=Recall, repr=False)

    @property
    def judge(self) -> Problem:
        """The problem of the validation windows; a ValueError where nothing is held out."""
        if self.problem is None:
            raise ValueError("nothing is held out")
        return self.problem

    def relinearised(self, effects: Sequence[Effect]) -> "Holdout":
        """Validation windows around a model with `effects`."""
        return self if self.problem is None else self._with(self.problem.relinearised(effects))

    def finely(self) -> "Holdout":
        """Validation windows in the steps of the last fit, judged by all windows that there are for it."""
        if self.problem is None:
            return self
        wide = self.widely()
        return wide._with(self.problem.finely())

    def widely(self) -> "Holdout":
        """Validation windows that are also after 1 s all windows that there are for the last fit."""
        if self.last is None or self.last is self.long:
            return self
        return Holdout(self.problem, self.last, self.last, self.recall_last, self.recall_last)

    def _with(self, problem: Problem) -> "Holdout":
        """Validation windows of another problem; what is known of the declared model after 1 s stays known."""
        other = replace(self, problem=problem)
        if "late" in self.__dict__:
            other.__dict__["late"] = self.late
        return other

    def left(self, fits: Sequence[Fit]) -> np.ndarray:
        """Held-out residuals (F, W, M) of fits, each less its own nuisances."""
        problem = self.judge
        raw = problem.residual([f.effects for f in fits])
        return np.stack(
            [r - np.tensordot(f.nuisance, problem.nuisance, axes=1) for r, f in zip(raw, fits, strict=True)]
        )

    def worse_later(self, before: Fit, after: Fit) -> bool:
        """Whether joint positions after 1 s are further off with `after`, beyond doubt and by more than a little.

        Each with its numerical differences taken out: the declared model's rounding of the damping can hide a rotor
        inertia for a second, and then the true one looks worse.
        """
        if self.long is None or self.problem is None:
            return False
        p, long = self.problem, self.long
        part = p.layout.slices["joint_pos"]

        def simulated(new: Sequence[Sequence[Effect]]) -> np.ndarray:
            models = [vary(p.plant, effects) for effects in new]
            return residuals(p.plant, p.layout, long, models, p.fine)[:, :, -1, part]

        raw = self.recall.get((long,), [before.effects, after.effects], p.fine, simulated)
        diverged = ~np.isfinite(raw).all(axis=2)
        if diverged[1].sum() > diverged[0].sum():
            return True
        kept = ~diverged.any(axis=0)
        rule = p.thresholds.comparison.later
        if not _grown(raw[:, kept] / p.sigma[part], rule):
            return False
        differs = np.stack([np.tensordot(fit.nuisance[: len(self.late)], self.late, axes=1) for fit in (before, after)])
        return _grown((raw - differs)[:, kept] / p.sigma[part], rule)

    @cached_property
    def late(self) -> np.ndarray:
        """(B, L, J) what numerical differences do to joint positions after 1 s [rad]; 0 where they diverge."""
        p = self.judge
        assert self.long is not None
        columns = nuisance_columns(
            p.plant, p.layout, self.long, vary(p.plant, []), p.fine, p.thresholds.residuals.nuisances
        )
        return np.nan_to_num(columns[:, :, -1, p.layout.slices["joint_pos"]], posinf=0.0, neginf=0.0)


def _grown(error: np.ndarray, rule: Later) -> bool:
    """Whether errors (2, L, J), in the noise's standard deviations, are larger in the second, beyond doubt.

    By the logarithm of a window's mean square, or by the mean square itself.
    """
    power = (error**2).mean(axis=2)
    if power.shape[1] < rule.windows:
        return False
    least = (rule.growth, rule.growth_of_square * float(power[0].mean()))
    return any(
        _beyond(change[1] - change[0], none, rule) for change, none in zip((np.log1p(power), power), least, strict=True)
    )


def _beyond(growth: np.ndarray, none: float, rule: Later) -> bool:
    """Whether the mean growth (L,) is more than `none` and more than its error."""
    # Of four windows, two standard errors are one chance in fourteen: a true armature was refused by them.
    doubt = student.ppf(norm.cdf(rule.z), len(growth) - 1) * growth.std(ddof=1) / np.sqrt(len(growth))
    return bool(growth.mean() > max(none, doubt))
