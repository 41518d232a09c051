"""K-means: order, smallest clusters, elbow."""

import numpy as np
import pandas as pd
import pytest
from sklearn.metrics import adjusted_rand_score

from bumblebee.clustering.elbow import elbow_curve, knee
from bumblebee.clustering.kmeans import fill_small, fit_clusters, plane_shares, project, random_clusters
from bumblebee.errors import BadInput


def blobs(sizes: tuple[int, ...], seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Points around far-apart centres in five dimensions, and which centre each belongs to."""
    draw = np.random.default_rng(seed)
    truth = np.repeat(np.arange(len(sizes)), sizes)
    return 10.0 * np.eye(len(sizes), 5)[truth] + 0.3 * draw.normal(size=(len(truth), 5)), truth


def test_clusters_are_numbered_by_speed() -> None:
    latents, truth = blobs((10, 7, 9))
    speeds = np.array([0.8, 0.1, 0.4])[truth]
    clusters = fit_clusters(latents, speeds, 3)
    means = [speeds[clusters.labels == c].mean() for c in range(3)]
    assert means == sorted(means) and adjusted_rand_score(truth, clusters.labels) == 1.0
    assert clusters.moved == () and (clusters.predict(latents) == clusters.labels).all()


def test_same_seed_same_labels() -> None:
    latents = np.random.default_rng(1).normal(size=(40, 4))
    runs = [fit_clusters(latents, np.arange(40.0), 4, seed=3).labels for _ in range(2)]
    assert (runs[0] == runs[1]).all()


def test_small_cluster_takes_the_cheapest_clips() -> None:
    """A cluster of one gets the nearest clips of the others, and no more than it needs."""
    latents, truth = blobs((10, 10, 1))
    clusters = fit_clusters(latents, truth.astype(float), 3, min_clips=3)
    assert sorted(np.bincount(clusters.labels)) == [3, 8, 10] or sorted(np.bincount(clusters.labels)) == [3, 9, 9]
    assert len(clusters.moved) == 2 and clusters.labels[20] == clusters.labels[clusters.moved[0]]


def test_fill_takes_nobody_below_the_minimum() -> None:
    distances = np.array([[0.0, 5.0, 9.0], [0.0, 1.0, 9.0], [4.0, 0.0, 6.0], [9.0, 0.0, 2.0], [3.0, 0.0, 8.0]])
    labels, moved = fill_small(distances, 1)
    assert labels.tolist() == [0, 0, 1, 2, 1] and moved == (3,)


def test_too_few_clips_is_one_line() -> None:
    with pytest.raises(BadInput, match="at least 3 x 2 training clips"):
        fit_clusters(np.zeros((5, 2)), np.zeros(5), 3, min_clips=2)


def test_elbow_falls_and_bends_at_the_true_number() -> None:
    latents, _ = blobs((12, 12, 12, 12))
    curve = elbow_curve(latents, 10)
    assert curve["k"].tolist() == list(range(1, 11)) and (np.diff(curve["within_ss"]) <= 1e-9).all()
    assert knee(curve) == 4 and int(curve.loc[curve["silhouette"].idxmax(), "k"]) == 4
    assert curve["within_ss"].iloc[0] == pytest.approx(((latents - latents.mean(0)) ** 2).sum())


def test_elbow_stops_at_the_number_of_different_clips() -> None:
    assert elbow_curve(np.repeat(np.arange(3.0), 4)[:, None], 10)["k"].tolist() == [1, 2, 3]
    assert knee(pd.DataFrame({"k": [1], "within_ss": [0.0]})) is None


def test_projection_keeps_two_dimensions_exactly() -> None:
    """Points of a plane keep their distances; rows that were not fitted are placed by the same map."""
    flat = (
        np.random.default_rng(0).normal(size=(20, 2)) @ np.linalg.qr(np.random.default_rng(1).normal(size=(6, 2)))[0].T
    )
    plane = project(flat, np.arange(20) < 15)
    between = np.linalg.norm(flat[:, None] - flat[None], axis=-1)
    np.testing.assert_allclose(np.linalg.norm(plane[:, None] - plane[None], axis=-1), between, atol=1e-9)
    assert project(np.array([[0.0], [1.0], [5.0]]), np.ones(3, bool)).shape == (3, 2)


def test_the_planes_axes_say_how_much_variance_they_hold() -> None:
    wide = np.array([[3.0, 1, 0], [-3, 1, 0], [3, -1, 0], [-3, -1, 0], [99, 99, 99]])
    np.testing.assert_allclose(plane_shares(wide, np.arange(5) < 4), [0.9, 0.1], atol=1e-12)
    assert plane_shares(np.ones((4, 1)), np.ones(4, bool)) == [0.0, 0.0]


def test_random_clusters_have_equal_sizes_and_depend_on_the_seed_alone() -> None:
    labels = random_clusters(50, 4, seed=3)
    assert sorted(np.bincount(labels)) == [12, 12, 13, 13]
    assert (labels == random_clusters(50, 4, seed=3)).all() and (labels != random_clusters(50, 4, seed=4)).any()
