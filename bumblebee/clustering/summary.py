"""Summary of a clustering: counts, the paper's table 2, the elbow, the audit."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from bumblebee.clustering import elbow as elbows
from bumblebee.clustering.audit import cluster_table
from bumblebee.clustering.config import ClusterConfig
from bumblebee.clustering.material import Material

Json = dict[str, Any]


def head(
    curve: pd.DataFrame,
    materials: Sequence[Material],
    names: Sequence[str],
    labels: np.ndarray,
    config: ClusterConfig,
) -> Json:
    """How it was clustered, into how many, what the elbow suggests, what was clustered, and table 2."""
    bend = elbow(curve, len(names))
    return {
        "method": config.method,
        "k": len(names),
        "suggested_k": bend["suggested_k"],
        "elbow": bend,
        "clips": counts(materials),
        "clusters": clusters(materials, names, labels, config),
    }


def counts(materials: Sequence[Material]) -> Json:
    """Clips by split and by where their texts come from, and how many windows have one."""
    sources = [own.source for own in materials]
    return {
        "train": sum(not own.held_out for own in materials),
        "held_out": sum(own.held_out for own in materials),
        "with_captions": sum(bool(own.captions) for own in materials),
        "texts": {source: sources.count(source) for source in sorted(set(sources))},
        "windows": sum(len(own.windows) for own in materials),
        "windows_with_captions": sum(bool(texts) for own in materials for texts in own.texts),
    }


def clusters(
    materials: Sequence[Material], names: Sequence[str], labels: np.ndarray, config: ClusterConfig
) -> dict[str, Json]:
    """Cluster -> its row of table 2, over the training clips, and how many clips it has of which split.

    Args:
        materials: all clips.
        names: of the clusters.
        labels: (N,) each clip's cluster.
        config: the stage's.
    """
    fitted = np.array([not own.held_out for own in materials])
    train = [own for own in materials if not own.held_out]
    statistics = pd.DataFrame([own.statistics for own in train])
    table = cluster_table(statistics, [own.written for own in train], labels[fitted], len(names))
    if config.method == "random":
        table["label"] = "random"
    held_out = np.bincount(labels[~fitted], minlength=len(names))
    return {
        name: {**row, "held_out_clips": int(count), "share": row["clips"] / len(train)}
        for name, row, count in zip(names, table.to_dict("records"), held_out, strict=True)
    }


def elbow(curve: pd.DataFrame, k: int) -> Json:
    """Suggestion of the elbow, by which rule, over which K; and the K with the largest silhouette."""
    best = curve.dropna(subset=["silhouette"])
    return {
        "suggested_k": elbows.knee(curve),
        "k": k,
        "rule": elbows.RULE,
        "from": int(curve["k"].min()),
        "to": int(curve["k"].max()),
        "silhouette_k": int(best.loc[best["silhouette"].idxmax(), "k"]) if len(best) else None,
    }


def family_beside_text(material: Material) -> str:
    """The family that the clip's agreement with its cluster is judged by; "" where that would be circular.

    A caption made of the file's name is what the autoencoder saw, and the family was read from the same name.
    """
    return "" if material.caption_source == "name" else material.family
