"""The clustering from clips to labels: features, captions, autoencoder, K-means, audit (paper, "AE Clustering")."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from bumblebee.clustering import audit, kmeans
from bumblebee.clustering.autoencoder import TextMotionAutoencoder
from bumblebee.clustering.config import ClusterConfig
from bumblebee.clustering.features import motion_windows
from bumblebee.clustering.statistics import clip_statistics
from bumblebee.clustering.text import TokenTable, embed_captions, evidence, plain_text
from bumblebee.clustering.train import encode_clips, train
from bumblebee.errors import BadInput
from bumblebee.motion.clip import Clip


@dataclass(frozen=True)
class Clustering:
    """What the stage keeps.

    `labels`: name, cluster, x, y, split, one row a clip. `statistics`: the clip's numbers of table 2, by name.
    `elbow`: k, within_ss, silhouette. `curve`: the loss terms by epoch. `summary`: plain values for JSON.
    """

    labels: pd.DataFrame
    statistics: pd.DataFrame
    elbow: pd.DataFrame
    curve: pd.DataFrame
    summary: dict[str, Any]
    model: TextMotionAutoencoder


def cluster_clips(
    clips: Sequence[Clip],
    cluster_names: Sequence[str],
    config: ClusterConfig,
    report: Callable[[int, str], None] = lambda epoch, note: None,
    table: TokenTable | None = None,
) -> Clustering:
    """Cluster a library.

    Autoencoder and K-means see the training clips only; held-out ones are encoded and go to the nearest centre.

    Args:
        clips: all clips, training and held out.
        cluster_names: one for each cluster, the slowest cluster's first.
        config: the stage's settings.
        report: called after each epoch of training with its number and a short note.
        table: token features of the captions; made by `config.text_encoder` if not given.
    """
    fitted = np.array([clip.split != "test" for clip in clips], bool)
    k = len(cluster_names)
    _enough(int(fitted.sum()), k, config.min_clips)
    if table is None:
        table = embed_captions([text for clip in clips for text in clip.captions], config.text_encoder)
    windows = [motion_windows(clip, config.fps, config.window_seconds) for clip in clips]
    row_of = {text: row for row, text in enumerate(table.captions)}
    captions = [sorted({row_of[text] for text in map(plain_text, clip.captions) if text in row_of}) for clip in clips]
    rows = np.flatnonzero(fitted)
    model, curve = train([windows[i] for i in rows], [captions[i] for i in rows], table, config, report)
    latents = encode_clips(model, windows)
    statistics = pd.DataFrame([clip_statistics(clip) for clip in clips])
    speeds = statistics["speed"].to_numpy()
    clusters = kmeans.fit_clusters(latents[fitted], speeds[fitted], k, config.seed, config.min_clips)
    assigned = clusters.predict(latents)
    assigned[fitted] = clusters.labels
    labels = _labels(clips, cluster_names, assigned, kmeans.project(latents, fitted))
    elbow = kmeans.elbow_curve(latents[fitted], config.max_k, config.seed)
    summary = _summary(clips, cluster_names, config, statistics, latents, fitted, clusters, elbow, curve)
    statistics.insert(0, "name", labels["name"])
    return Clustering(labels, statistics, elbow, curve, summary, model)


def family_beside_text(clip: Clip) -> str:
    """The family that the clip's agreement with its cluster is judged by; "" where that would be circular.

    A caption made of the file's name is what the autoencoder saw, and the family was read from the same name.
    """
    return "" if clip.caption_source == "name" else clip.family


def texts_by_source(clips: Sequence[Clip]) -> dict[str, int]:
    """How many clips have their texts from where: "file", "csv", "humanml3d", "made", "name", "none" or "unknown"."""
    sources = ["none" if not clip.captions else clip.caption_source or "unknown" for clip in clips]
    return {source: sources.count(source) for source in sorted(set(sources))}


def _enough(training: int, k: int, min_clips: int) -> None:
    if training < k * min_clips:
        expected = f"at least {k} x {min_clips} training clips for {k} clusters"
        remedy = "Name fewer clusters in params.yaml, lower cluster.min_clips, or add motions"
        raise BadInput("params.yaml: clusters", expected, f"{training} training clips", remedy)


def _labels(clips: Sequence[Clip], names: Sequence[str], assigned: np.ndarray, plane: np.ndarray) -> pd.DataFrame:
    columns = {
        "name": [clip.name for clip in clips],
        "cluster": [names[label] for label in assigned],
        "x": plane[:, 0],
        "y": plane[:, 1],
        "split": [clip.split for clip in clips],
        "family": [clip.family for clip in clips],
    }
    return pd.DataFrame(columns)


def _summary(
    clips: Sequence[Clip],
    names: Sequence[str],
    config: ClusterConfig,
    statistics: pd.DataFrame,
    latents: np.ndarray,
    fitted: np.ndarray,
    clusters: kmeans.Clusters,
    elbow: pd.DataFrame,
    curve: pd.DataFrame,
) -> dict[str, Any]:
    train_clips = [clip for clip, use in zip(clips, fitted, strict=True) if use]
    train_statistics = statistics[fitted].reset_index(drop=True)
    texts = [evidence(clip.captions, clip.caption_source, clip.name) for clip in train_clips]
    table = audit.cluster_table(train_statistics, texts, clusters.labels, len(names))
    held_out = np.bincount(clusters.predict(latents[~fitted]), minlength=len(names))
    rows = table.to_dict("records")
    by_name = {
        name: {**row, "held_out_clips": int(count), "share": row["clips"] / len(train_clips)}
        for name, row, count in zip(names, rows, held_out, strict=True)
    }
    families = [family_beside_text(clip) for clip in train_clips]
    return {
        "k": len(names),
        "suggested_k": kmeans.knee(elbow),
        "clips": {
            "train": len(train_clips),
            "held_out": int((~fitted).sum()),
            "with_captions": sum(bool(clip.captions) for clip in clips),
            "texts": texts_by_source(clips),
        },
        "clusters": by_name,
        "plane_variance": kmeans.plane_shares(latents, fitted),
        "moved_to_fill": [train_clips[i].name for i in clusters.moved],
        "loss": {name: float(curve.iloc[-1][name]) for name in curve.columns if name != "epoch"},
        "audit": audit.audit(train_statistics, families, latents[fitted], clusters, config.audit_seeds, config.seed),
    }
