"""Figures of the audit with their intervals: `{"value", "ci95", "n"}`, plain values for JSON."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from sklearn.metrics import adjusted_mutual_info_score

Json = dict[str, Any]
Index = Callable[[np.ndarray, np.ndarray], float]
FEWEST = 8
"""Clips below which no interval is given."""
_DRAWS = 200
_Z = 1.959964


def estimate(value: float | None, interval: Sequence[float] | None, n: int) -> Json:
    """A figure, its 95 % interval (None where there is none), and how many it was taken over."""
    low, high = (None, None) if interval is None else (float(interval[0]), float(interval[1]))
    return {"value": None if value is None else float(value), "ci95": [low, high], "n": int(n)}


def between(values: Sequence[float]) -> Json:
    """The mean of a few values, and their least and largest in place of an interval; n counts the values."""
    return (
        estimate(float(np.mean(values)), (min(values), max(values)), len(values))
        if len(values)
        else estimate(None, None, 0)
    )


def wilson(share: float, n: int) -> tuple[float, float]:
    """Wilson's 95 % interval of a share of n trials."""
    centre, spread = share + _Z**2 / (2 * n), _Z * np.sqrt(share * (1 - share) / n + _Z**2 / (4 * n * n))
    return max(0.0, (centre - spread) / (1 + _Z**2 / n)), min(1.0, (centre + spread) / (1 + _Z**2 / n))


def bootstrap(
    values: np.ndarray, statistic: Callable[[np.ndarray], float], seed: int = 0
) -> tuple[float, float] | None:
    """95 % percentiles of a statistic over draws of the rows with replacement; None for fewer than `FEWEST`."""
    if len(values) < FEWEST:
        return None
    draw = np.random.default_rng(seed)
    rows = draw.integers(len(values), size=(_DRAWS, len(values)))
    low, high = np.percentile([statistic(values[row]) for row in rows], [2.5, 97.5])
    return float(low), float(high)


def agreement(index: Index, a: np.ndarray, b: np.ndarray, seed: int = 0) -> Json:
    """How far two labellings (N,) of the same clips agree, with `chance95`: what labels in random order reach.

    The interval is of half samples: the index on random halves of the clips spreads as widely as the index on all of
    them does from one library to another. A bootstrap would draw clips twice, which always agree with themselves.
    """
    draw = np.random.default_rng(seed)
    n = len(a)
    found = estimate(index(a, b), None, n) | {"chance95": [None, None]}
    if n < FEWEST:
        return found
    halves = [draw.permutation(n)[: n // 2] for _ in range(_DRAWS)]
    found["ci95"] = _percentiles([index(a[half], b[half]) for half in halves])
    found["chance95"] = _percentiles([index(a, b[draw.permutation(n)]) for _ in range(_DRAWS)])
    return found


def adjusted_rand(a: np.ndarray, b: np.ndarray) -> float:
    """Adjusted Rand index of labels 0, 1, 2 ... (Hubert and Arabie 1985); scikit-learn's, without its checks."""
    table = np.bincount(a * (b.max() + 1) + b, minlength=0).astype(float)
    both, own, other = (float((n * (n - 1)).sum()) / 2 for n in (table, np.bincount(a), np.bincount(b)))
    expected = own * other / (len(a) * (len(a) - 1) / 2)
    most = (own + other) / 2
    return 1.0 if most == expected else (both - expected) / (most - expected)


def numbered(labels: Sequence[Any] | np.ndarray) -> np.ndarray:
    """Labels of any kind as 0, 1, 2 ..."""
    return np.unique(np.asarray(labels), return_inverse=True)[1]


def rand(a: Sequence[Any] | np.ndarray, b: Sequence[Any] | np.ndarray, seed: int = 0) -> Json:
    """Adjusted Rand index: 1 the same clusters, 0 chance."""
    return agreement(adjusted_rand, numbered(a), numbered(b), seed)


def mutual_information(a: Sequence[Any] | np.ndarray, b: Sequence[Any] | np.ndarray, seed: int = 0) -> Json:
    """Adjusted mutual information: 1 the same clusters, 0 chance."""
    return agreement(adjusted_mutual_info_score, numbered(a), numbered(b), seed)


def pairwise_rand(runs: Sequence[np.ndarray]) -> Json:
    """Mean adjusted Rand index between all pairs of labellings, with the least and the largest; n counts the pairs."""
    return between([adjusted_rand(a, b) for i, a in enumerate(runs) for b in runs[i + 1 :]])


def _percentiles(values: Sequence[float]) -> list[float]:
    return [float(value) for value in np.percentile(values, [2.5, 97.5])]
