"""Tests of paired windows: gains of log(1 + chi-square) from one residual to another, and how sure they are."""

import numpy as np
from scipy.stats import norm, wilcoxon
from scipy.stats import t as student

from bumblebee.diagnosis.thresholds.comparison import Confirmed, Plausible


def logs(residual: np.ndarray) -> np.ndarray:
    """log(1 + chi-square) (..., W) of every window of whitened residuals (..., W, M)."""
    return np.log1p((residual**2).mean(axis=-1))


def margin(gain: np.ndarray, z: float = 2.0) -> float:
    """So many standard errors of the mean of (W,) differences between windows, by Student's t where these are few."""
    return float(student.ppf(norm.cdf(z), len(gain) - 1) * gain.std(ddof=1) / np.sqrt(len(gain)))


def confirmed(before: np.ndarray, after: np.ndarray, rule: Confirmed) -> bool:
    """Whether windows (W, M) are better `after`: log(1 + chi-square) falls beyond doubt by its mean or by ranks."""
    gain = logs(before) - logs(after)
    if gain.mean() <= 0:
        return False
    spread = gain.std(ddof=1) / np.sqrt(len(gain)) + 1e-30
    ranks = wilcoxon(gain, alternative="greater").pvalue if len(gain) > rule.rank_windows else 1.0
    return bool(gain.mean() > rule.z * spread or ranks < norm.sf(rule.z))


def plausible(clean: np.ndarray, change: np.ndarray, rule: Plausible) -> bool:
    """Whether a change (W, M) that few windows feel takes nearly all of their excess of log(1 + chi-square)."""
    before, after = logs(clean), logs(clean - change)
    felt = np.abs(before - after) > rule.felt
    excess = np.maximum(before[felt] - np.log(2.0), 0.0).sum()
    return felt.sum() >= rule.several or float((before - after)[felt].sum()) > rule.mostly * excess


def there(old: np.ndarray, new: np.ndarray, weights: np.ndarray, z: float) -> bool:
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


def falls(old: np.ndarray, new: np.ndarray, z: float, rank_windows: int) -> bool:
    """Whether log(1 + chi-square) falls beyond doubt: `z` standard errors, or as much by signed ranks.

    The ranks are not swayed by a few odd windows, nor the logarithm where the model is far off.
    """
    gain = logs(old) - logs(new)
    spread = gain.std(ddof=1) / np.sqrt(len(gain)) if len(gain) > 1 else np.inf
    ranks = wilcoxon(gain, alternative="greater").pvalue if np.count_nonzero(gain) > rank_windows else 1.0
    return bool(gain.mean() > 0 and (gain.mean() >= z * spread or ranks <= norm.sf(z)))
