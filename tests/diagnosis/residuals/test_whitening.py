"""Errors by steps of a finite length are weighed as the readings' noise is."""

from dataclasses import replace

import numpy as np
import pytest

from bumblebee.diagnosis.residuals.whitening import Sampled, Stepped, factors_of
from bumblebee.diagnosis.thresholds.residuals import Whitening

WINDOWS, READINGS = 6, 12
SIGMA = np.array([1e-6, 1e-4])


@pytest.fixture
def sampled() -> Sampled:
    """Starts without noise: what is left is the readings'."""
    size = READINGS * len(SIGMA)
    return Sampled(np.zeros((8, WINDOWS, size)), np.ones((8, WINDOWS, 4)), np.ones(WINDOWS, bool))


def by(change: np.ndarray, left: np.ndarray | None = None) -> Stepped:
    """Changes by longer steps, and what is left in short ones, nothing by default."""
    return Stepped(change, np.zeros_like(change) if left is None else left)


def test_without_an_error_of_the_steps_a_reading_counts_by_its_noise(sampled: Sampled) -> None:
    rule = replace(Whitening(), curved=0.0)
    factors = factors_of(sampled, SIGMA, rule, by(np.zeros((WINDOWS, READINGS, 2))))
    assert np.allclose(factors, np.diag(1 / np.tile(SIGMA, READINGS)))
    assert np.array_equal(factors, factors_of(sampled, SIGMA, rule))


def test_a_numerical_error_far_above_the_noise_is_no_evidence(sampled: Sampled) -> None:
    """An error like that of the steps comes out near 1, where the noise alone would make thousands of it."""
    rule, rng = Whitening(), np.random.default_rng(0)
    stepped = rng.standard_normal((WINDOWS, READINGS, 2)) * [1e-3, 1e-3]
    error = (rule.stepped * stepped).reshape(WINDOWS, -1)

    def power(factors: np.ndarray) -> float:
        return float((np.einsum("wij,wj->wi", factors, error) ** 2).mean())

    assert power(factors_of(sampled, SIGMA, rule)) > 1e4
    assert power(factors_of(sampled, SIGMA, rule, by(stepped))) < 1.0


def test_windows_that_diverge_in_longer_steps_keep_their_noise(sampled: Sampled) -> None:
    nothing = np.full((WINDOWS, READINGS, 2), np.nan)
    found = factors_of(sampled, SIGMA, Whitening(), by(nothing, nothing))
    assert np.array_equal(found, factors_of(sampled, SIGMA, Whitening()))


@pytest.mark.parametrize(("windows", "counts"), [(2, True), (4, False)])
def test_where_far_more_is_left_in_most_windows_than_steps_change_they_take_no_weight(
    sampled: Sampled, windows: int, counts: bool
) -> None:
    """A servo that lacks its friction errs by far more than its integrator: windows keep the weight of their noise."""
    rule, rng = Whitening(), np.random.default_rng(0)
    stepped = 1e-3 * rng.standard_normal((WINDOWS, READINGS, 2))
    left = np.zeros((WINDOWS, READINGS, 2))
    left[:windows, :, 0] = 10 * rule.explained * stepped[:windows, :, 0]
    found = factors_of(sampled, SIGMA, rule, by(stepped, left))
    near = factors_of(sampled, SIGMA, rule, by(stepped))
    without = factors_of(sampled, SIGMA, rule)
    assert np.array_equal(found, near if counts else without) and not np.allclose(near, without)


def test_a_signal_at_rest_that_shows_its_noise_does_not_take_the_steps_error_from_the_others(sampled: Sampled) -> None:
    """Longer steps change nothing of a joint that stands; its noise is more, and no missing effect."""
    rule, rng = Whitening(), np.random.default_rng(0)
    stepped = 1e-3 * rng.standard_normal((WINDOWS, READINGS, 2)) * [1.0, 0.0]
    noise = SIGMA * rng.standard_normal((WINDOWS, READINGS, 2))
    assert np.array_equal(
        factors_of(sampled, SIGMA, rule, by(stepped, stepped + noise)), factors_of(sampled, SIGMA, rule, by(stepped))
    )
