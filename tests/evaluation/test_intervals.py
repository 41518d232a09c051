"""Intervals and paired tests against known values and by simulation."""

import numpy as np
import pytest

from bumblebee.evaluation.intervals import (
    bootstrap_mean,
    mcnemar_test,
    mean_by_motion,
    sign_flip_test,
    success_rate,
    wilson,
)


@pytest.mark.parametrize(
    ("successes", "trials", "low", "high"),
    [
        (0, 10, 0.0, 0.2775),
        (10, 10, 0.7225, 1.0),
        (81, 263, 0.2553, 0.3662),
        (15, 148, 0.0624, 0.1605),
        (1, 29, 0.0061, 0.1718),
    ],
)
def test_wilson_agrees_with_newcombe_1998(successes: int, trials: int, low: float, high: float) -> None:
    assert wilson(successes, trials) == pytest.approx((low, high), abs=5e-5)


@pytest.mark.parametrize("trials", [1, 3, 10, 36, 263, 2.7182818, 9.5, 12.345678])
@pytest.mark.parametrize("confidence", [0.8, 0.95, 0.99])
def test_wilson_ends_at_one_for_all_and_at_nought_for_none_exactly(trials: float, confidence: float) -> None:
    """0.1 * 3 of 0.3 is all as well: an effective number of successes carries rounding errors."""
    low, high = wilson(trials, trials, confidence)
    assert high == 1.0 and 0.0 < low < 1.0
    low, high = wilson(0.0, trials, confidence)
    assert low == 0.0 and 0.0 < high < 1.0
    assert wilson(np.nextafter(trials, 0), trials, confidence)[1] == 1.0
    assert wilson(np.nextafter(trials, 2 * trials), trials, confidence)[1] == 1.0


def test_independent_episodes_keep_wilsons_interval() -> None:
    success = np.array([1, 0] * 20)
    estimate = success_rate(success, np.arange(40))
    assert (estimate.low, estimate.high) == pytest.approx(wilson(20, 40), abs=0.01)


def test_seeds_that_repeat_a_motions_result_add_no_evidence() -> None:
    """Ten motions, four identical seeds each: as wide as ten episodes, not as forty."""
    success, motions = np.repeat([1] * 6 + [0] * 4, 4), np.repeat(np.arange(10), 4)
    estimate = success_rate(success, motions)
    assert estimate.high - estimate.low == pytest.approx(np.diff(wilson(6, 10))[0], rel=0.06)
    whole = success_rate(np.ones(40), motions)
    assert (whole.value, whole.low) == pytest.approx((1.0, wilson(10, 10)[0]))


def test_the_bootstrap_interval_covers() -> None:
    """95 % intervals of the mean of 12 skewed values cover the true mean in 88-98 % of 300 draws."""
    rng = np.random.default_rng(0)
    hits = 0
    for draw in range(300):
        low, high = bootstrap_mean(rng.gamma(3.0, 1.0, 12), seed=draw)
        hits += low <= 3.0 <= high
    assert 0.88 <= hits / 300 <= 0.98


def test_motions_weigh_the_same_whatever_their_number_of_episodes() -> None:
    estimate = mean_by_motion(np.array([1.0, 1.0, 1.0, 3.0, np.nan]), np.array(["a", "a", "a", "b", "c"]))
    assert estimate.value == pytest.approx(2.0) and estimate.motions == 2 and estimate.episodes == 4


def test_nothing_gives_null_and_not_a_number_in_json() -> None:
    assert mean_by_motion(np.array([np.nan]), np.array(["a"])).as_dict() == {
        "n": 0,
        "motions": 0,
        "value": None,
        "ci95": [None, None],
    }


def test_sign_flips_are_exact_for_few_motions() -> None:
    assert sign_flip_test(np.array([1.0, 2.0, 3.0, 4.0, 5.0])) == pytest.approx(2 / 32)
    assert sign_flip_test(np.array([1.0, -1.0])) == 1.0
    assert sign_flip_test(np.zeros(8)) == 1.0


def test_sign_flips_find_a_shift_among_many_and_none_among_noise() -> None:
    rng = np.random.default_rng(1)
    noise = rng.standard_normal(40)
    assert sign_flip_test(noise + 1.0) < 0.001
    assert sign_flip_test(noise - noise.mean() + 0.01) > 0.5


def test_mcnemar_counts_discordant_pairs_only() -> None:
    first = np.array([True] * 50 + [False] * 6)
    second = np.array([True] * 56)
    assert mcnemar_test(first, second) == pytest.approx(2 / 2**6)
    assert mcnemar_test(first, first) == 1.0
