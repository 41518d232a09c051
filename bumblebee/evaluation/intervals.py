"""Intervals and paired tests where episodes of one motion are not independent of each other.

The unit of evidence is the motion: seeds of one motion share its difficulty, so all resampling is over motions.
"""

from dataclasses import dataclass

import numpy as np
from scipy import stats

CONFIDENCE = 0.95
RESAMPLES = 4000
ROUNDING = 1e-12  # what arithmetic may add to a share: an effective number of trials is a quotient
EXACT_LIMIT = 14  # motions up to which all sign flips are listed: 2^14


@dataclass(frozen=True)
class Estimate:
    """A value with its 95 % interval and the number of episodes and motions behind it."""

    value: float
    low: float
    high: float
    episodes: int
    motions: int

    def as_dict(self) -> dict[str, object]:
        """As it stands in `summary.json`; an estimate from nothing is null."""
        ci95 = [_finite(self.low), _finite(self.high)]
        return {"n": self.episodes, "motions": self.motions, "value": _finite(self.value), "ci95": ci95}


def wilson(successes: float, trials: float, confidence: float = CONFIDENCE) -> tuple[float, float]:
    """Wilson's score interval of a proportion; (0, 1) where nothing was tried. `trials` may be an effective number.

    The formula's lower end of none and upper end of all are 0 and 1; they are given as such, without rounding errors.
    """
    if trials <= 0:
        return 0.0, 1.0
    z = float(stats.norm.ppf(0.5 + confidence / 2))
    share = min(max(successes / trials, 0.0), 1.0)
    centre = (share + z**2 / (2 * trials)) / (1 + z**2 / trials)
    half = z / (1 + z**2 / trials) * np.sqrt(share * (1 - share) / trials + z**2 / (4 * trials**2))
    low, high = float(max(centre - half, 0.0)), float(min(centre + half, 1.0))
    return 0.0 if share <= ROUNDING else low, 1.0 if share >= 1.0 - ROUNDING else high


def success_rate(success: np.ndarray, motions: np.ndarray) -> Estimate:
    """Share of successes with Wilson's interval at the effective number of episodes.

    The effective number is n / deff, deff from the variance between motions (cluster-robust variance over the binomial
    one, not below 1). Where the variance is nought (all succeed, or none) it is the number of motions.

    Args:
        success: (N,) bool, one per episode.
        motions: (N,) names, the motion of each episode.
    """
    success = np.asarray(success, dtype=float)
    names, index = np.unique(np.asarray(motions), return_inverse=True)
    count, groups = len(success), len(names)
    if count == 0:
        return Estimate(float("nan"), 0.0, 1.0, 0, 0)
    share = float(success.mean())
    effective = float(groups)
    if 0 < share < 1 and groups > 1:
        residual = np.bincount(index, weights=success - share)
        clustered = groups / (groups - 1) * float((residual**2).sum()) / count**2
        deff = max(clustered / (share * (1 - share) / count), 1.0)
        effective = max(min(count / deff, count), 1.0)
    return Estimate(share, *wilson(share * effective, effective), count, groups)


def mean_by_motion(values: np.ndarray, motions: np.ndarray, seed: int = 0) -> Estimate:
    """Mean over motions of the motion's mean, with a bootstrap interval over motions.

    Percentiles, widened to Student's t interval where motions are few: the bootstrap of a handful is too narrow.

    Args:
        values: (N,) one number per episode, NaN left out.
        motions: (N,) names.
        seed: of the resampling.
    """
    means = motion_means(values, motions)
    kept = int(np.isfinite(np.asarray(values, dtype=float)).sum())
    if len(means) == 0:
        return Estimate(float("nan"), float("nan"), float("nan"), 0, 0)
    value = float(means.mean())
    return Estimate(value, *bootstrap_mean(means, seed), kept, len(means))


def motion_means(values: np.ndarray, motions: np.ndarray) -> np.ndarray:
    """(M,) mean of the finite values of each motion, motions sorted by name; those without any are left out."""
    values, motions = np.asarray(values, dtype=float), np.asarray(motions)
    keep = np.isfinite(values)
    names, index = np.unique(motions[keep], return_inverse=True)
    if len(names) == 0:
        return np.zeros(0)
    return np.bincount(index, weights=values[keep]) / np.bincount(index)


def bootstrap_mean(values: np.ndarray, seed: int = 0, confidence: float = CONFIDENCE) -> tuple[float, float]:
    """Bootstrap interval of the mean of independent values (M,): percentiles, scaled to Student's t for small M."""
    values = np.asarray(values, dtype=float)
    count = len(values)
    if count < 2:
        return float("nan"), float("nan")
    rng = np.random.default_rng(seed)
    means = values[rng.integers(0, count, (RESAMPLES, count))].mean(axis=1)
    tail = (1 - confidence) / 2
    low, high = np.quantile(means, [tail, 1 - tail])
    centre = values.mean()
    widen = stats.t.ppf(1 - tail, count - 1) / stats.norm.ppf(1 - tail) * np.sqrt(count / (count - 1))
    return float(centre - (centre - low) * widen), float(centre + (high - centre) * widen)


def sign_flip_test(differences: np.ndarray, seed: int = 0) -> float:
    """Two-sided p-value that paired differences by motion (M,) are centred on nought, by flipping their signs.

    All 2^M flips where M <= 14, else 4,000 drawn ones with the observed one counted in. 1.0 where nothing differs.
    """
    differences = np.asarray(differences, dtype=float)
    count = len(differences)
    if count == 0 or not np.any(differences):
        return 1.0
    if count <= EXACT_LIMIT:
        signs = 1 - 2 * ((np.arange(2**count)[:, None] >> np.arange(count)) & 1)
        drawn = 0
    else:
        signs = np.random.default_rng(seed).choice([-1, 1], (RESAMPLES, count))
        drawn = 1
    extreme = np.abs(signs @ differences) >= abs(differences.sum()) * (1 - 1e-12)
    return float((extreme.sum() + drawn) / (len(signs) + drawn))


def mcnemar_test(first: np.ndarray, second: np.ndarray) -> float:
    """Exact two-sided p-value of McNemar's test for paired successes (N,) bool: a binomial of discordant pairs."""
    first, second = np.asarray(first, dtype=bool), np.asarray(second, dtype=bool)
    gained, lost = int((second & ~first).sum()), int((first & ~second).sum())
    return 1.0 if gained + lost == 0 else float(stats.binomtest(gained, gained + lost, 0.5).pvalue)


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
