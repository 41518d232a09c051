"""Is a clustering meaningful? Statistics by cluster, agreement, stability, and a random split beside it."""

from collections.abc import Sequence
from itertools import combinations

import numpy as np
import pandas as pd
from sklearn.cluster import KMeans
from sklearn.metrics import adjusted_rand_score

from bumblebee.clustering.kmeans import Clusters
from bumblebee.clustering.statistics import COLUMNS, keywords, names


def cluster_table(
    statistics: pd.DataFrame, captions: Sequence[Sequence[str]], labels: np.ndarray, k: int
) -> pd.DataFrame:
    """One row a cluster: `clips`, means of the statistics, `keywords`, `label` (the paper's table 2)."""
    means = statistics[list(COLUMNS)].groupby(labels).mean().reindex(range(k))
    means.insert(0, "clips", np.bincount(labels, minlength=k))
    means["keywords"] = [", ".join(words) for words in keywords(captions, labels, k)]
    means["label"] = names(means)
    return means.reset_index(drop=True)


def family_agreement(families: Sequence[str], labels: np.ndarray) -> float | None:
    """Adjusted Rand index with the families that are known; None with fewer than two of them."""
    known = np.array([bool(family) for family in families])
    if len(set(np.asarray(families)[known])) < 2:
        return None
    return float(adjusted_rand_score(np.asarray(families)[known], labels[known]))


def stability(latents: np.ndarray, k: int, seeds: int, seed: int = 0, share: float = 0.8) -> dict[str, float]:
    """Mean adjusted Rand index between pairs of clusterings of the same latents (N, Z).

    `seeds`: K-means restarted once from each of several seeds. `subsamples`: fitted on a random `share` of the
    clips, all of them labelled; this shows how much the clusters hang on single clips. 1 means the same clusters.
    """
    draw = np.random.default_rng(seed)
    size = min(len(latents), max(k, round(share * len(latents))))
    restarts = [KMeans(k, n_init=1, random_state=seed + i).fit_predict(latents) for i in range(seeds)]
    parts = [latents[draw.choice(len(latents), size, replace=False)] for _ in range(seeds)]
    subsamples = [KMeans(k, n_init=10, random_state=seed).fit(part).predict(latents) for part in parts]
    return {"seeds": _mean_agreement(restarts), "subsamples": _mean_agreement(subsamples)}


def separation(statistics: pd.DataFrame, labels: np.ndarray) -> dict[str, float]:
    """Share of each statistic's variance over clips that lies between clusters (eta squared), 0 to 1."""
    values = statistics[list(COLUMNS)]
    total = values.var(ddof=0)
    within = values.groupby(labels).transform(lambda column: column - column.mean()).pow(2).mean()
    share = 1 - within / total.where(total > 0)
    return {name: float(value) for name, value in share.fillna(0.0).items()}


def random_control(statistics: pd.DataFrame, labels: np.ndarray, seeds: int, seed: int = 0) -> dict[str, float]:
    """`separation` of random splits into clusters of the same sizes, mean over seeds: what chance alone reaches."""
    draw = np.random.default_rng(seed)
    rows = [separation(statistics, draw.permutation(labels)) for _ in range(seeds)]
    return pd.DataFrame(rows).mean().to_dict()


def audit(
    statistics: pd.DataFrame,
    families: Sequence[str],
    latents: np.ndarray,
    clusters: Clusters,
    seeds: int,
    seed: int = 0,
) -> dict[str, object]:
    """Agreement, stability and separation of the fitted clips' clustering, as plain values for JSON."""
    k = len(clusters.centres)
    return {
        "family_ari": family_agreement(families, clusters.labels),
        "stability": stability(latents, k, seeds, seed),
        "separation": separation(statistics, clusters.labels),
        "separation_random_split": random_control(statistics, clusters.labels, seeds, seed),
    }


def _mean_agreement(runs: Sequence[np.ndarray]) -> float:
    pairs = [adjusted_rand_score(a, b) for a, b in combinations(runs, 2)]
    return float(np.mean(pairs)) if pairs else 1.0
