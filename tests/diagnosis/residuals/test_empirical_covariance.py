"""Windows measured by what a fit leaves: white noise stays as it is, loud directions lose their say."""

import numpy as np

from bumblebee.diagnosis.residuals.empirical_covariance import metric_of
from bumblebee.diagnosis.thresholds.residuals import EmpiricalCovariance

W, M = 300, 12
RULE = EmpiricalCovariance()


def estimate(left: np.ndarray, column: np.ndarray, metric: np.ndarray) -> float:
    """Least squares of `left` (W, M) on `column` (W, M), both turned by `metric`."""
    a, b = left @ metric.T, column @ metric.T
    return float((a * b).sum() / (b * b).sum())


def test_white_noise_keeps_every_estimate() -> None:
    rng = np.random.default_rng(0)
    metric = metric_of(rng.standard_normal((4000, M)), RULE)
    np.testing.assert_allclose(metric / metric[0, 0], np.eye(M), atol=0.05)


def test_what_is_left_becomes_white() -> None:
    rng = np.random.default_rng(1)
    mix = rng.standard_normal((M, M)) * np.geomspace(100.0, 1.0, M)
    left = rng.standard_normal((W, M)) @ mix + rng.standard_normal((W, M))
    spectrum = np.linalg.eigvalsh(np.cov((left @ metric_of(left, RULE).T).T))
    assert np.linalg.cond(np.cov(left.T)) > 1e3
    assert spectrum.max() < 2.0  # and no direction is louder than the noise would be


def test_an_effect_beside_a_loud_misfit_is_told_ten_times_better() -> None:
    rng = np.random.default_rng(2)
    loud = np.outer(rng.standard_normal(W), np.linspace(0.0, 30.0, M))  # grows along the window, another way in each
    sizes = []
    for _ in range(40):
        column = rng.standard_normal((W, M)) + 0.3 * np.linspace(0.0, 1.0, M)
        left = loud * rng.choice([-1.0, 1.0], size=(W, 1)) + rng.standard_normal((W, M)) + 0.2 * column
        sizes.append([estimate(left, column, metric) for metric in (np.eye(M), metric_of(left, RULE))])
    plain, better = np.std(sizes, axis=0)
    assert better < 0.1 * plain
    assert abs(np.mean(sizes, axis=0)[1] - 0.2) < 3 * better / np.sqrt(40)
