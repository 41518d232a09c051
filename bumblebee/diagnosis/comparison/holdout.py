"""Whether an effect pays on windows that took no part in its fit, at 0.2 s and, where the data reach, at 1 s.

Near the truth an effect is looked for in its own direction, where nearly all of the noise is orthogonal to it. Far from
it gains are differences of log(1 + chi-square) by window, so that a few windows beside an unstable pose do not outvote
the rest.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy.stats import norm, wilcoxon
from scipy.stats import t as student

from bumblebee.diagnosis.estimation import Fit, cost_of
from bumblebee.diagnosis.residuals import Problem, nuisance_columns, window_weights
from bumblebee.diagnosis.simulation import Recall, Windows, residuals, vary
from bumblebee.sim.effects import Effect

_FEW = 8  # windows that ranks can be trusted with
_WORSE = 0.02  # a longer window's error may grow by this share
_DOUBT = norm.cdf(2.0)  # that it has not grown
_OF_REST = 0.2  # share of what is left that is never a trifle


@dataclass(frozen=True, eq=False)
class Holdout:
    """What acceptance is decided on; without windows everything is accepted."""

    problem: Problem | None = None
    long: Windows | None = None
    """Windows of 1 s, their last tick compared."""
    recall: Recall = field(default_factory=Recall, repr=False)

    def relinearised(self, effects: Sequence[Effect]) -> "Holdout":
        """The same around a model with `effects`."""
        return self if self.problem is None else self._with(self.problem.relinearised(effects))

    def finely(self) -> "Holdout":
        """The same in the steps of the last fit."""
        return self if self.problem is None else self._with(self.problem.finely())

    def _with(self, problem: Problem) -> "Holdout":
        """The same on another problem; what is known of the declared model after 1 s stays known."""
        other = replace(self, problem=problem)
        if "late" in self.__dict__:
            other.__dict__["late"] = self.late
        return other

    def left(self, fits: Sequence[Fit]) -> np.ndarray:
        """Held-out residuals (F, W, M) of fits, each less its own nuisances."""
        problem = self.problem
        if problem is None:
            raise ValueError("nothing is held out")
        raw = problem.residual([f.effects for f in fits])
        return np.stack(
            [r - np.tensordot(f.nuisance, problem.nuisance, axes=1) for r, f in zip(raw, fits, strict=True)]
        )

    def logs(self, fits: Sequence[Fit]) -> np.ndarray:
        """log(1 + chi-square) of every fit on every window, (F, W)."""
        return np.log1p((self.left(fits) ** 2).mean(axis=2))

    def gains(self, before: Fit, after: Fit, z: float, least: float) -> bool:
        """Whether what `after` changes is there in the held-out windows, too, and not a trifle; and no worse after 1 s.

        The held-out residual of `before` is compared with the change that `after` predicts there, and with nothing
        else: in a robot of many joints an effect of one is a small share of the whole chi-square, and none of its
        noise. `after` must gain the share `least` of what it and all effects before it gain together: where one law
        stands for a slightly different one, the rest is significant, too. A fifth of what is left is enough: of a robot
        far from its model, a hundredth of what a drive of half the strength explains is more than all friction.
        """
        if self.problem is None:
            return True
        problem = self.problem
        old, new = self.left([before, after])
        weights = window_weights(new)
        bare = problem.residual([[]])[0]
        bare = bare - np.tensordot(cost_of(problem, bare, weights)[1], problem.nuisance, axes=1)
        powers = [float((weights[:, None] * r**2).sum()) for r in (bare, old, new)]
        worth = min(least * (powers[0] - powers[2]), _OF_REST * powers[1])
        if powers[1] - powers[2] < worth:
            return False
        if not (_there(old, new, weights, z) or _better(old, new, z)):
            return False
        return not self.worse_later(before, after)

    def worse_later(self, before: Fit, after: Fit) -> bool:
        """Whether joint positions after 1 s are further off with `after`, beyond doubt and by more than a little.

        Each with its numerical differences taken out: the declared model's rounding of the damping can hide a rotor
        inertia for a second, and then the true one looks worse.
        """
        if self.long is None or self.problem is None:
            return False
        p = self.problem
        part = p.layout.slices["joint_pos"]

        def simulated(new: Sequence[Sequence[Effect]]) -> np.ndarray:
            models = [vary(p.plant, effects) for effects in new]
            return residuals(p.plant, p.layout, self.long, models, p.fine)[:, :, -1, part]

        raw = self.recall.get((self.long,), [before.effects, after.effects], p.fine, simulated)
        diverged = ~np.isfinite(raw).all(axis=2)
        if diverged[1].sum() > diverged[0].sum():
            return True
        kept = ~diverged.any(axis=0)
        if not _grown(raw[:, kept] / p.sigma[part]):
            return False
        differs = np.stack([np.tensordot(fit.nuisance[: len(self.late)], self.late, axes=1) for fit in (before, after)])
        return _grown((raw - differs)[:, kept] / p.sigma[part])

    @cached_property
    def late(self) -> np.ndarray:
        """(B, L, J) what numerical differences do to joint positions after 1 s [rad]; 0 where they diverge."""
        p = self.problem
        columns = nuisance_columns(
            p.plant, p.layout, self.long, vary(p.plant, []), p.fine, p.thresholds.residuals.nuisances
        )
        return np.nan_to_num(columns[:, :, -1, p.layout.slices["joint_pos"]], posinf=0.0, neginf=0.0)


def _grown(error: np.ndarray) -> bool:
    """Whether errors (2, L, J), in the noise's standard deviations, are larger in the second, beyond doubt."""
    growth = np.diff(np.log1p((error**2).mean(axis=2)), axis=0)[0]
    if len(growth) < 3:
        return False
    # Of four windows, two standard errors are one chance in fourteen: a true armature was refused by them.
    doubt = student.ppf(_DOUBT, len(growth) - 1) * growth.std(ddof=1) / np.sqrt(len(growth))
    return bool(growth.mean() > max(_WORSE, doubt))


def _there(old: np.ndarray, new: np.ndarray, weights: np.ndarray, z: float) -> bool:
    """Whether the change from residuals `old` to `new` (W, M) is found in `old`: its regression on the change.

    1 is the whole of it; from a half on the weighted chi-square falls.
    """
    change = old - new
    size = weights * (change**2).sum(axis=1)
    share = float((weights * (change * old).sum(axis=1)).sum() / max(size.sum(), 1e-12))
    scores = weights * (change * old).sum(axis=1) - share * size
    error = float(np.sqrt((scores**2).sum()) / max(size.sum(), 1e-12))
    error = max(error, 1.0 / np.sqrt(max(size.sum(), 1e-12)))  # few windows: no surer than the noise allows
    return share > 0.5 and share > z * error


def _better(old: np.ndarray, new: np.ndarray, z: float) -> bool:
    """Whether log(1 + chi-square) falls beyond doubt: `z` standard errors, or as much by signed ranks.

    The ranks are not swayed by a few odd windows, nor the logarithm where the model is far off.
    """
    gain = np.log1p((old**2).mean(axis=1)) - np.log1p((new**2).mean(axis=1))
    spread = gain.std(ddof=1) / np.sqrt(len(gain)) if len(gain) > 1 else np.inf
    ranks = wilcoxon(gain, alternative="greater").pvalue if np.count_nonzero(gain) > _FEW else 1.0
    return bool(gain.mean() > 0 and (gain.mean() >= z * spread or ranks <= norm.sf(z)))
