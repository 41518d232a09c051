"""Is a clustering meaningful? Its table, its agreement with other labels, its stability, and chance beside each."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from sklearn.metrics import silhouette_samples

from bumblebee.clustering.config import ClusterConfig
from bumblebee.clustering.estimates import Json, between, bootstrap, estimate, mutual_information, pairwise_rand, rand
from bumblebee.clustering.kinds import RULES, kinds
from bumblebee.clustering.kmeans import kmeans, random_clusters
from bumblebee.clustering.stability import stability
from bumblebee.clustering.statistics import COLUMNS, keywords, names

_MOST_FOR_SILHOUETTE = 5000  # clips


@dataclass(frozen=True, eq=False)
class Audited:
    """The fitted clips' clustering and what it is judged by.

    `statistics`: their numbers. `families`: "" where unknown or circular. `latents` (N, Z), `labels` (N,), `k`.
    `retrained`: latents of the same clips by autoencoders of other seeds. `motion_only`: by one trained without texts,
    None where there were none or nobody asked.
    """

    statistics: pd.DataFrame
    families: Sequence[str]
    latents: np.ndarray
    labels: np.ndarray
    k: int
    retrained: Sequence[np.ndarray] = ()
    motion_only: np.ndarray | None = None


def audit(found: Audited, config: ClusterConfig) -> Json:
    """All of it, as plain values for JSON; `estimates` says what stands in each figure."""
    seed, seeds = config.seed, config.audit_seeds
    if config.method == "random":
        others = [random_clusters(len(found.labels), found.k, seed + i) for i in range(seeds)]
        steady: dict[str, Json] = {"seeds": pairwise_rand(others), "subsamples": between(()), "retrained": between(())}
    else:
        steady = stability(found.latents, found.retrained, found.k, seeds, seed)
    chance = random_control(found.statistics, found.labels, seeds, seed)
    return {
        "method": config.method,
        "family_ari": family_agreement(found.families, found.labels, seed),
        "kinematic": kinematic_agreement(found.statistics, found.labels, seed),
        "stability": steady,
        "silhouette": silhouette(found.latents, found.labels, seed),
        "balance": balance(found.labels, found.k),
        "separation": separation(found.statistics, found.labels),
        "separation_random_split": chance.mean().to_dict(),
        "separation_random_most": chance.max().to_dict(),
        "motion_only": without_texts(found, config),
    }


def cluster_table(
    statistics: pd.DataFrame, captions: Sequence[Sequence[str]], labels: np.ndarray, k: int
) -> pd.DataFrame:
    """One row a cluster: `clips`, means of the statistics, `keywords`, `label` (the paper's table 2)."""
    means = statistics[list(COLUMNS)].groupby(labels).mean().reindex(range(k))
    means.insert(0, "clips", np.bincount(labels, minlength=k))
    means["keywords"] = [", ".join(words) for words in keywords(captions, labels, k)]
    means["label"] = names(statistics, labels, k)
    return means.reset_index(drop=True)


def family_agreement(families: Sequence[str], labels: np.ndarray, seed: int = 0) -> Json | None:
    """Adjusted Rand index with the families that are known; None with fewer than two of them."""
    known = np.array([bool(family) for family in families])
    if len(set(np.asarray(families)[known])) < 2:
        return None
    return rand(np.asarray(families)[known], labels[known], seed)


def kinematic_agreement(statistics: pd.DataFrame, labels: np.ndarray, seed: int = 0) -> Json:
    """With the kinds of `kinds.RULES`: adjusted Rand index, adjusted mutual information, clips of each kind."""
    own = kinds(statistics)
    counts = {name: int((own == name).sum()) for name, _ in RULES}
    return {"ari": rand(own, labels, seed), "ami": mutual_information(own, labels, seed), "clips": counts}


def silhouette(latents: np.ndarray, labels: np.ndarray, seed: int = 0) -> Json:
    """Mean over clips of how much nearer their own cluster is than the next one, -1 to 1; of 5,000 clips at most."""
    rows = np.random.default_rng(seed).permutation(len(labels))[:_MOST_FOR_SILHOUETTE]
    latents, labels = latents[rows], labels[rows]
    if not 1 < len(set(labels.tolist())) < len(labels):
        return estimate(None, None, len(labels))
    values = silhouette_samples(latents, labels)
    return estimate(values.mean(), bootstrap(values, np.mean, seed), len(values))


def balance(labels: np.ndarray, k: int) -> Json:
    """How evenly the clips are shared: `evenness` 1 for equal sizes, 0 for all in one; smallest and largest share."""
    share = np.bincount(labels, minlength=k) / len(labels)
    entropy = -(share[share > 0] * np.log(share[share > 0])).sum()
    even = float(entropy / np.log(k)) if k > 1 else 1.0
    return {"evenness": even, "smallest": float(share.min()), "largest": float(share.max()), "n": len(labels)}


def separation(statistics: pd.DataFrame, labels: np.ndarray) -> dict[str, float]:
    """Share of each statistic's variance over clips that lies between clusters (eta squared), 0 to 1."""
    values = statistics[list(COLUMNS)]
    total = values.var(ddof=0)
    within = values.groupby(labels).transform(lambda column: column - column.mean()).pow(2).mean()
    share = 1 - within / total.where(total > 0)
    return {name: float(value) for name, value in share.fillna(0.0).items()}


def random_control(statistics: pd.DataFrame, labels: np.ndarray, seeds: int, seed: int = 0) -> pd.DataFrame:
    """`separation` of random splits into clusters of the same sizes, one row a seed: what chance alone reaches."""
    draw = np.random.default_rng(seed)
    return pd.DataFrame([separation(statistics, draw.permutation(labels)) for _ in range(seeds)])


def without_texts(found: Audited, config: ClusterConfig) -> Json | None:
    """Clusters of the autoencoder that saw no text, beside ours: agreement of both, and what each sets apart."""
    if found.motion_only is None:
        return None
    labels = kmeans(found.motion_only, found.k, config.seed).labels_
    return {
        "ari": rand(found.labels, labels, config.seed),
        "separation": separation(found.statistics, labels),
        "silhouette": silhouette(found.motion_only, labels, config.seed),
        "kinematic_ari": rand(kinds(found.statistics), labels, config.seed),
        "family_ari": family_agreement(found.families, labels, config.seed),
    }
