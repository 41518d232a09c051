"""Intervals: Wilson's for shares, bootstrap percentiles for medians and means."""

from collections.abc import Callable, Sequence

import numpy as np
from scipy.stats import norm

_Z = float(norm.ppf(0.975))


def wilson(hits: int, count: int) -> tuple[float, float]:
    """95 % interval of a share, `hits` of `count`; (0, 1) for none."""
    if count == 0:
        return 0.0, 1.0
    share, z2 = hits / count, _Z**2
    centre = (share + z2 / (2 * count)) / (1 + z2 / count)
    half = _Z / (1 + z2 / count) * np.sqrt(share * (1 - share) / count + z2 / (4 * count**2))
    return float(max(0.0, centre - half)), float(min(1.0, centre + half))


def bootstrap(
    values: Sequence[float], statistic: Callable[..., np.ndarray] = np.median, draws: int = 2000, seed: int = 0
) -> tuple[float, float]:
    """95 % percentile interval of a statistic of `values`, cases drawn with replacement; `statistic` takes `axis`."""
    table = np.asarray(values, dtype=float)
    if len(table) < 2:
        return float("nan"), float("nan")
    picks = np.random.default_rng(seed).integers(0, len(table), (draws, len(table)))
    low, high = np.quantile(statistic(table[picks], axis=1), [0.025, 0.975])
    return float(low), float(high)
