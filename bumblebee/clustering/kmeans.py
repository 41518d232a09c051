"""K-means on motion latents (paper, section "AE Clustering"), clusters at random, and the plane to see both in."""

from dataclasses import dataclass

import numpy as np
from sklearn.cluster import KMeans
from sklearn.decomposition import PCA

from bumblebee.errors import BadInput


@dataclass(frozen=True)
class Clusters:
    """A clustering in canonical order.

    `labels` (N,) of the clips that were fitted, `centres` (K, Z), `moved`: which of the fitted clips did not go to
    the nearest centre, because a cluster would otherwise have fewer than the wanted number of clips.
    """

    labels: np.ndarray
    centres: np.ndarray
    moved: tuple[int, ...]

    def predict(self, latents: np.ndarray) -> np.ndarray:
        """Nearest centre of latents (M, Z) that took no part in the fit: (M,)."""
        return _distances(latents, self.centres).argmin(1)


def kmeans(latents: np.ndarray, k: int, seed: int, starts: int = 10) -> KMeans:
    """K-means on latents (N, Z): the best of several starts."""
    return KMeans(k, n_init=starts, random_state=seed).fit(latents)


def fit_clusters(latents: np.ndarray, speeds: np.ndarray, k: int, seed: int = 0, min_clips: int = 1) -> Clusters:
    """K-means on latents (N, Z), K clusters numbered by mean root speed of their clips, slowest first.

    Args:
        latents: z_m of the training clips.
        speeds: mean root speed of each, (N,) [m/s].
        k: number of clusters.
        seed: of the ten starts.
        min_clips: smaller clusters take the clips that it costs least to move from clusters that can spare them.
    """
    if len(latents) < k * min_clips:
        expected = f"at least {k} x {min_clips} training clips for {k} clusters"
        remedy = "Name fewer clusters in params.yaml, lower cluster.min_clips, or add motions"
        raise BadInput("params.yaml: clusters", expected, f"{len(latents)} clips", remedy)
    fit = kmeans(latents, k, seed)
    labels, moved = fill_small(_distances(latents, fit.cluster_centers_), min_clips)
    centres = np.stack([latents[labels == c].mean(0) for c in range(k)])
    order = np.argsort([speeds[labels == c].mean() for c in range(k)], kind="stable")
    rank = np.empty(k, int)
    rank[order] = np.arange(k)
    return Clusters(rank[labels], centres[order], moved)


def random_clusters(count: int, k: int, seed: int) -> np.ndarray:
    """Labels (count,) drawn at random, in K clusters whose sizes differ by one clip at most."""
    return np.random.default_rng(seed).permutation(np.arange(count) % k)


def fill_small(distances: np.ndarray, min_clips: int) -> tuple[np.ndarray, tuple[int, ...]]:
    """Nearest centres for squared distances (N, K), changed least so that each has `min_clips`; and the clips moved.

    One clip at a time: the one whose squared distance grows least by the move, out of clusters above the minimum.
    """
    labels = distances.argmin(1)
    moved: list[int] = []
    rows = np.arange(len(labels))
    while (counts := np.bincount(labels, minlength=distances.shape[1])).min() < min_clips:
        small = int(counts.argmin())
        cost = distances[:, small] - distances[rows, labels]
        cost[counts[labels] <= min_clips] = np.inf
        clip = int(cost.argmin())
        labels[clip] = small
        moved.append(clip)
    return labels, tuple(sorted(moved))


def project(latents: np.ndarray, fitted: np.ndarray) -> np.ndarray:
    """Plane coordinates (N, 2) by PCA of the rows where `fitted` (N,) is true; a plot, nothing is decided on it."""
    size = min(2, int(fitted.sum()), latents.shape[1])
    flat = PCA(size, svd_solver="full").fit(latents[fitted]).transform(latents)
    return np.pad(flat, ((0, 0), (0, 2 - size)))


def plane_shares(latents: np.ndarray, fitted: np.ndarray) -> list[float]:
    """Shares of the fitted rows' variance along the two axes of `project`; 0 for an axis that there is not."""
    size = min(2, int(fitted.sum()), latents.shape[1])
    shares = np.nan_to_num(PCA(size, svd_solver="full").fit(latents[fitted]).explained_variance_ratio_)
    return [float(share) for share in np.pad(shares, (0, 2 - size))]


def _distances(latents: np.ndarray, centres: np.ndarray) -> np.ndarray:
    return np.square(latents[:, None] - centres[None]).sum(-1)
