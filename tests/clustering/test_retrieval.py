"""Ranks, chance and intervals of retrieval, against cases counted by hand."""

import numpy as np
import pytest

from bumblebee.clustering.retrieval import direction, first_ranks, hit_by_chance, median_by_chance, retrieval


def test_the_rank_is_that_of_the_first_right_answer_and_a_tie_counts_against_it() -> None:
    near = np.array([[0.9, 0.8, 0.1], [0.2, 0.5, 0.5], [0.3, 0.2, 0.9]])
    right = np.array([[0, 1, 0], [0, 0, 1], [1, 0, 1]], bool)
    assert first_ranks(near, right).tolist() == [2, 2, 1]


def test_chance_is_that_of_a_random_order() -> None:
    assert hit_by_chance(10, 1, 1) == pytest.approx(0.1) and hit_by_chance(3, 1, 10) == 1.0
    assert hit_by_chance(4, 2, 2) == pytest.approx(5 / 6)  # of the six pairs of four one has neither
    draw = np.random.default_rng(0)
    ranks = [1 + min(draw.permutation(20)[:3]) for _ in range(4000)]
    assert hit_by_chance(20, 3, 5) == pytest.approx(np.mean(np.array(ranks) <= 5), abs=0.03)
    assert median_by_chance(20, [3] * 7) == pytest.approx(np.median(ranks), abs=1)
    assert median_by_chance(9, [1]) == 5


def test_equal_latents_find_each_other_and_random_ones_do_as_chance_says() -> None:
    draw = np.random.default_rng(1)
    z = draw.normal(size=(40, 16))
    same = retrieval(z, 3 * z, np.eye(40, dtype=bool), np.arange(40))
    assert same["text_to_motion"]["R@1"]["value"] == 1.0 and same["motion_to_text"]["MedR"]["value"] == 1
    assert same["text_to_motion"]["R@1"]["ci95"][0] < 0.95 and not same["few"]  # 40 of 40 are no certainty
    other = retrieval(z, draw.normal(size=(40, 16)), np.eye(40, dtype=bool), np.arange(40))["text_to_motion"]
    assert other["R@10"]["ci95"][0] < other["R@10"]["chance"] == 0.25 < other["R@10"]["ci95"][1]


def test_two_motions_with_the_same_caption_are_both_right_and_windows_of_a_clip_count_once() -> None:
    texts, motions = np.array([[1.0, 0], [0, 1.0]]), np.array([[1.0, 0], [0.9, 0.1], [0, 1.0]])
    found = retrieval(texts, motions, np.array([[1, 1, 0], [0, 0, 1]], bool), np.array([5, 5, 9]))
    assert found["motion_to_text"]["R@1"]["value"] == 1.0 and found["motion_to_text"]["R@1"]["n"] == 2
    assert found["text_to_motion"]["answers"] == 3 and found["few"]


def test_a_clip_of_many_windows_weighs_no_more_than_one_of_few() -> None:
    near = np.array([[1.0, 0]] * 3 + [[1.0, 0]])
    right = np.array([[1, 0]] * 3 + [[0, 1]], bool)
    assert direction(near, right, np.array([0, 0, 0, 1]))["R@1"]["value"] == 0.5
