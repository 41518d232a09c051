"""Do the same clips come together again: with another seed, without some of the clips, with another K."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from sklearn.cluster import KMeans

from bumblebee.clustering.estimates import Json, adjusted_rand, pairwise_rand
from bumblebee.clustering.kmeans import kmeans


def restarts(latents: np.ndarray, k: int, seeds: int, seed: int = 0) -> list[np.ndarray]:
    """K-means on the same latents (N, Z), started once from each of several seeds."""
    return [KMeans(k, n_init=1, random_state=seed + i).fit_predict(latents) for i in range(seeds)]


def subsamples(latents: np.ndarray, k: int, seeds: int, seed: int = 0, share: float = 0.8) -> list[np.ndarray]:
    """K-means fitted on a random `share` of the clips, all of them labelled: how much hangs on single clips."""
    draw = np.random.default_rng(seed)
    size = min(len(latents), max(k, round(share * len(latents))))
    parts = [latents[draw.choice(len(latents), size, replace=False)] for _ in range(seeds)]
    return [kmeans(part, k, seed).predict(latents) for part in parts]


def stability(latents: np.ndarray, others: Sequence[np.ndarray], k: int, seeds: int, seed: int = 0) -> dict[str, Json]:
    """Mean adjusted Rand index between pairs of clusterings of the same clips; 1 means the same clusters.

    `seeds`: restarts. `subsamples`: fitted without a fifth of the clips. `retrained`: the autoencoder trained anew with
    another seed, whose latents are `others`; K-means on each.
    """
    trained = [kmeans(z, k, seed).labels_ for z in (latents, *others)]
    return {
        "seeds": pairwise_rand(restarts(latents, k, seeds, seed)),
        "subsamples": pairwise_rand(subsamples(latents, k, seeds, seed)),
        "retrained": pairwise_rand(trained),
    }


def over_k(
    latents: np.ndarray, others: Sequence[np.ndarray], used: np.ndarray, most: int, seeds: int, seed: int = 0
) -> pd.DataFrame:
    """For each K from 2 to `most`: adjusted Rand indices `subsamples`, `retrained`, and `with_used` clusters (N,)."""
    rows = []
    for k in range(2, most + 1):
        own = kmeans(latents, k, seed).labels_
        trained = [own, *(kmeans(z, k, seed).labels_ for z in others)]
        left_out = pairwise_rand(subsamples(latents, k, seeds, seed))["value"]
        rows.append((k, left_out, pairwise_rand(trained)["value"], adjusted_rand(used, own)))
    return (
        pd.DataFrame(rows, columns=["k", "subsamples", "retrained", "with_used"])
        .astype({"k": int})
        .astype(dict.fromkeys(("subsamples", "retrained", "with_used"), float))
    )
