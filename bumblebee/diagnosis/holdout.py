"""Whether an effect pays on windows that took no part in its fit, at 0.2 s and, where the data reach, at 1 s.

Gains are differences of log(1 + chi-square) by window: as linear as chi-square where a model is nearly right, and the
log of the error where it is far off, so that a few windows beside an unstable pose do not outvote the rest.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import norm, wilcoxon

from bumblebee.diagnosis.fit import Fit
from bumblebee.diagnosis.problem import Problem
from bumblebee.diagnosis.simulate import residuals
from bumblebee.diagnosis.variation import vary
from bumblebee.diagnosis.windows import Windows
from bumblebee.sim.effects import Effect

_FEW = 8  # windows that ranks can be trusted with
_WORSE = 0.02  # a longer window's error may grow by this share


@dataclass(frozen=True, eq=False)
class Holdout:
    """What acceptance is decided on; without windows everything is accepted."""

    problem: Problem | None = None
    long: Windows | None = None
    """Windows of 1 s, their last tick compared."""

    def relinearised(self, effects: Sequence[Effect]) -> "Holdout":
        """The same around a model with `effects`."""
        return self if self.problem is None else replace(self, problem=self.problem.relinearised(effects))

    def logs(self, fits: Sequence[Fit]) -> np.ndarray:
        """log(1 + chi-square) of every fit on every window, (F, W)."""
        problem = self.problem
        if problem is None:
            raise ValueError("nothing is held out")
        raw = problem.residual([f.effects for f in fits])
        left = np.stack(
            [r - np.tensordot(f.nuisance, problem.nuisance, axes=1) for r, f in zip(raw, fits, strict=True)]
        )
        return np.log1p((left**2).mean(axis=2))

    def gains(self, before: Fit, after: Fit, z: float, least: float) -> bool:
        """Whether `after` is better by the share `least` of chi-square and beyond doubt, and no worse after 1 s.

        Beyond doubt is `z` standard errors of the mean or as much by signed ranks, which a few odd windows do not sway.
        """
        if self.problem is None:
            return True
        logs = self.logs([before, after])
        gain = logs[0] - logs[1]
        spread = gain.std(ddof=1) / np.sqrt(len(gain)) if len(gain) > 1 else np.inf
        ranks = wilcoxon(gain, alternative="greater").pvalue if np.count_nonzero(gain) > _FEW else 1.0
        least *= float(-np.expm1(-logs[0]).mean())  # a share of chi-square, as a difference of its log(1 + .)
        if gain.mean() < least or (gain.mean() < z * spread and ranks > norm.sf(z)):
            return False
        return not self.worse_later(before.effects, after.effects)

    def worse_later(self, before: Sequence[Effect], after: Sequence[Effect]) -> bool:
        """Whether joint positions after 1 s are further off with `after`, beyond doubt and by more than a little."""
        if self.long is None or self.problem is None:
            return False
        p = self.problem
        models = [vary(p.plant, e) for e in (before, after)]
        raw = residuals(p.plant, p.layout, self.long, models, p.fine)
        part = p.layout.slices["joint_pos"]
        error = (raw[:, :, -1, part] / p.sigma[part]) ** 2
        diverged = ~np.isfinite(error).all(axis=2)
        if diverged[1].sum() > diverged[0].sum():
            return True
        growth = np.diff(np.log1p(error[:, ~diverged.any(axis=0)].mean(axis=2)), axis=0)[0]
        if len(growth) < 3:
            return False
        return bool(growth.mean() > max(_WORSE, 2.0 * growth.std(ddof=1) / np.sqrt(len(growth))))
