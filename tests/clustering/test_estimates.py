"""Intervals hold what they should, and the fast index is the known one."""

import numpy as np
import pytest
from sklearn.metrics import adjusted_rand_score

from bumblebee.clustering.estimates import adjusted_rand, between, bootstrap, pairwise_rand, rand, wilson


def test_the_index_is_scikit_learns() -> None:
    draw = np.random.default_rng(0)
    for _ in range(20):
        a, b = draw.integers(0, 4, 30), draw.integers(0, 3, 30)
        assert adjusted_rand(a, b) == pytest.approx(adjusted_rand_score(a, b), abs=1e-12)
    assert adjusted_rand(np.zeros(5, int), np.zeros(5, int)) == 1.0


def test_labels_that_have_nothing_in_common_lie_within_chance_and_equal_ones_far_above() -> None:
    draw = np.random.default_rng(1)
    a = draw.integers(0, 3, 90)
    unlike, same = rand(a, draw.integers(0, 3, 90)), rand(list("abc"[i] for i in a), a)
    assert unlike["chance95"][0] < unlike["value"] < unlike["chance95"][1]
    assert same["value"] == 1.0 and same["chance95"][1] < 0.1 and same["n"] == 90


def test_the_interval_holds_the_index_of_other_libraries() -> None:
    """In nearly all of 40 draws of one world the world's own index lies in their interval."""
    held = 0
    for seed in range(40):
        draw = np.random.default_rng(seed)
        a = draw.integers(0, 2, 80)
        b = np.where(draw.uniform(size=80) < 0.2, 1 - a, a)
        low, high = rand(a, b, seed)["ci95"]
        held += low <= 0.36 <= high  # (1 - 2 x 0.2) squared: two equal clusters, a fifth of the labels swapped
    assert held >= 34


def test_few_clips_have_no_interval() -> None:
    assert rand([0, 1, 0], [0, 1, 1])["ci95"] == [None, None] and bootstrap(np.arange(5.0), np.mean) is None


def test_wilson_of_ten_of_ten() -> None:
    assert wilson(1.0, 10) == pytest.approx((0.7225, 1.0), abs=1e-4)
    assert wilson(0.0, 10)[0] == 0.0


def test_pairs_of_runs_say_their_least_and_largest() -> None:
    runs = [np.array([0, 0, 1, 1]), np.array([1, 1, 0, 0]), np.array([0, 1, 0, 1])]
    assert pairwise_rand(runs) == {"value": pytest.approx(0.0), "ci95": pytest.approx([-0.5, 1.0]), "n": 3}
    assert between(()) == {"value": None, "ci95": [None, None], "n": 0}
