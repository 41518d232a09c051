"""The clustering from clips to labels: features, captions, autoencoder, K-means, audit (paper, "AE Clustering")."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd

from bumblebee.clustering import kmeans, summary
from bumblebee.clustering.audit import Audited, audit
from bumblebee.clustering.autoencoder import TextMotionAutoencoder
from bumblebee.clustering.config import ClusterConfig
from bumblebee.clustering.elbow import elbow_curve
from bumblebee.clustering.map import form, motion_map
from bumblebee.clustering.material import Material, gather
from bumblebee.clustering.pairs import held_out_retrieval
from bumblebee.clustering.stability import over_k
from bumblebee.clustering.text import TokenTable, embed_captions
from bumblebee.clustering.train import encode_clips, planned_epochs, train
from bumblebee.errors import BadInput
from bumblebee.motion.clip import Clip

Report = Callable[[int, str], None]


@dataclass(frozen=True)
class Clustering:
    """Result that the stage keeps.

    `labels`: name, cluster, x, y, split, family, one row a clip. `statistics`: the clip's numbers of table 2, by name.
    `elbow`: k, within_ss, silhouette and the stability over K. `curve`: the loss terms by epoch. `points`: what the
    report's map shows, see `map.motion_map`. `summary`: plain values for JSON.
    """

    labels: pd.DataFrame
    statistics: pd.DataFrame
    elbow: pd.DataFrame
    curve: pd.DataFrame
    points: pd.DataFrame
    summary: dict[str, Any]
    model: TextMotionAutoencoder


@dataclass(frozen=True)
class Encoded:
    """An autoencoder, its curve, and the latents (N, Z) of all clips."""

    model: TextMotionAutoencoder
    curve: pd.DataFrame
    latents: np.ndarray


def cluster_clips(
    clips: Iterable[Clip],
    cluster_names: Sequence[str],
    config: ClusterConfig,
    report: Report = lambda epoch, note: None,
    table: TokenTable | None = None,
) -> Clustering:
    """Cluster a library; see `cluster`."""
    return cluster(gather(clips, config), cluster_names, config, report, table)


def cluster(
    materials: Sequence[Material],
    cluster_names: Sequence[str],
    config: ClusterConfig,
    report: Report = lambda epoch, note: None,
    table: TokenTable | None = None,
) -> Clustering:
    """Cluster what was gathered of a library.

    Autoencoder and K-means see the training clips only; held-out ones are encoded and go to the nearest centre.

    Args:
        materials: of all clips, training and held out.
        cluster_names: one for each cluster, the slowest cluster's first.
        config: the stage's settings.
        report: called after each epoch of each training with its number and a short note.
        table: token features of the captions; made by `config.text_encoder` if not given.
    """
    fitted = np.array([not own.held_out for own in materials], bool)
    enough(materials, cluster_names, config)
    if table is None:
        table = texts_of(materials, config)
    encoded = _encode(materials, table, config, report)
    latents = encoded.latents
    speeds = np.array([own.statistics["speed"] for own in materials])
    assigned, moved = _assign(latents, fitted, speeds, len(cluster_names), config)
    labels = _labels(materials, cluster_names, assigned, kmeans.project(latents, fitted))
    others = [_encode(materials, table, replace(config, seed=seed), report).latents for seed in _other_seeds(config)]
    bare = _without_texts(materials, config, report)
    judged = _audited(materials, fitted, assigned, len(cluster_names), [latents, *others], bare)
    curve = _elbow(judged, config)
    told = {
        **summary.head(curve, materials, cluster_names, assigned, config),
        "plane_variance": kmeans.plane_shares(latents, fitted),
        "moved_to_fill": [materials[np.flatnonzero(fitted)[i]].name for i in moved],
        "loss": {name: float(encoded.curve.iloc[-1][name]) for name in encoded.curve.columns if name != "epoch"},
        "audit": audit(judged, config),
        "retrieval": held_out_retrieval(encoded.model, table, materials),
        "map": form(),
    }
    statistics = pd.DataFrame([{"name": own.name, **own.statistics} for own in materials])
    points = motion_map(materials, labels, config.map_poses)
    return Clustering(labels, statistics, curve, encoded.curve, points, told, encoded.model)


def enough(materials: Sequence[Material], cluster_names: Sequence[str], config: ClusterConfig) -> None:
    """Refuse a library with fewer training clips than its clusters need.

    Raises:
        BadInput: naming the key that says how many clusters there are.
    """
    training, k = sum(not own.held_out for own in materials), len(cluster_names)
    if training < k * config.min_clips:
        expected = f"at least {k} x {config.min_clips} training clips for {k} clusters"
        remedy = "Name fewer clusters in params.yaml, lower cluster.min_clips, or add motions"
        raise BadInput("params.yaml: clusters", expected, f"{training} training clips", remedy)


def texts_of(materials: Sequence[Material], config: ClusterConfig) -> TokenTable:
    """Token features of all captions, by `config.text_encoder`."""
    return embed_captions([text for own in materials for text in own.captions], config.text_encoder)


def epochs_of(materials: Sequence[Material], config: ClusterConfig) -> int:
    """How many epochs all trainings have together."""
    training = sum(not own.held_out for own in materials)
    told = any(own.captions for own in materials if not own.held_out)
    trainings = 1 + config.audit_retrain + (config.audit_motion_only and told)
    return trainings * planned_epochs(max(1, training), config)


def _encode(materials: Sequence[Material], table: TokenTable, config: ClusterConfig, report: Report) -> Encoded:
    row_of = {text: row for row, text in enumerate(table.captions)}
    training = [own for own in materials if not own.held_out]
    captions = [[sorted({row_of[text] for text in texts if text in row_of}) for texts in own.texts] for own in training]
    model, curve = train([own.windows for own in training], captions, table, config, report)
    return Encoded(model, curve, encode_clips(model, [own.windows for own in materials]))


def _audited(
    materials: Sequence[Material],
    fitted: np.ndarray,
    assigned: np.ndarray,
    k: int,
    latents: Sequence[np.ndarray],
    bare: np.ndarray | None,
) -> Audited:
    """The fitted clips' part of everything; the first of `latents` is the clustering's own."""
    train = [own for own in materials if not own.held_out]
    return Audited(
        statistics=pd.DataFrame([own.statistics for own in train]),
        families=[summary.family_beside_text(own) for own in train],
        latents=latents[0][fitted],
        labels=assigned[fitted],
        k=k,
        retrained=[other[fitted] for other in latents[1:]],
        motion_only=None if bare is None else bare[fitted],
    )


def _elbow(judged: Audited, config: ClusterConfig) -> pd.DataFrame:
    """The elbow curve, with the stability for each K beside it."""
    curve = elbow_curve(judged.latents, config.max_k, config.seed)
    most = int(curve["k"].max())
    steady = over_k(judged.latents, judged.retrained, judged.labels, most, config.audit_seeds, config.seed)
    return curve.merge(steady, how="left", on="k")


def _assign(
    latents: np.ndarray, fitted: np.ndarray, speeds: np.ndarray, k: int, config: ClusterConfig
) -> tuple[np.ndarray, tuple[int, ...]]:
    """The cluster of each clip (N,), and which fitted clips were moved so that no cluster is too small."""
    if config.method == "random":
        assigned = np.empty(len(latents), int)
        for seed, rows in enumerate((fitted, ~fitted)):
            assigned[rows] = kmeans.random_clusters(int(rows.sum()), k, 2 * config.seed + seed)
        return assigned, ()
    clusters = kmeans.fit_clusters(latents[fitted], speeds[fitted], k, config.seed, config.min_clips)
    assigned = clusters.predict(latents)
    assigned[fitted] = clusters.labels
    return assigned, clusters.moved


def _other_seeds(config: ClusterConfig) -> list[int]:
    return [(config.seed + 1 + i) % 2**31 for i in range(config.audit_retrain)]


def _without_texts(materials: Sequence[Material], config: ClusterConfig, report: Report) -> np.ndarray | None:
    """Latents of an autoencoder of the same seed that saw no text; None where there is no text to leave out."""
    if not config.audit_motion_only or not any(own.captions for own in materials if not own.held_out):
        return None
    return _encode(materials, embed_captions((), config.text_encoder), config, report).latents


def _labels(
    materials: Sequence[Material], names: Sequence[str], assigned: np.ndarray, plane: np.ndarray
) -> pd.DataFrame:
    columns = {
        "name": [own.name for own in materials],
        "cluster": [names[label] for label in assigned],
        "x": plane[:, 0],
        "y": plane[:, 1],
        "split": [own.split for own in materials],
        "family": [own.family for own in materials],
    }
    return pd.DataFrame(columns)
