"""Motions of a benchmark: read from their sources, held out by name, filtered, cut and clustered."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd

from benchmarks.motion_pack import Packed, read_pack, write_pack
from bumblebee.clustering.config import ClusterConfig
from bumblebee.errors import BadInput
from bumblebee.io.read import file_hash
from bumblebee.motion.clip import Clip
from bumblebee.motion.describe.describer import DescribeConfig
from bumblebee.motion.filters.rules import filter_clips
from bumblebee.motion.pieces import hold_out, motion_of
from bumblebee.motion.reading.folder import ReadConfig, read_folder

MOTIONS, LABELS = "motions.npz", "labels.csv"
SHARE = 0.22
"""Share of each family's motions that is held out, by a hash of their names."""
CLUSTERING = ClusterConfig()


@dataclass(frozen=True)
class Motions:
    """Pieces of motions of at most 10 s, and the cluster of each."""

    rows: list[Packed]
    labels: pd.DataFrame
    """Columns name, motion (that the piece was cut from), group (its source), family, split, seconds, cluster."""
    hash: str

    @property
    def clusters(self) -> list[str]:
        """Names in order, the slowest motions first."""
        return sorted(self.labels["cluster"].unique())

    def training(self) -> list[Packed]:
        """Pieces to learn from."""
        return [row for row in self.rows if row.clip.split == "train"]

    def cluster_indices(self, clips: Sequence[Clip], random: int | None = None) -> list[int]:
        """The index of each clip's cluster in `clusters`; of its random cluster by this seed, if there is one."""
        named = self.labels.set_index("name")["cluster"] if random is None else self.random_clusters(random)
        index = {name: i for i, name in enumerate(sorted(named.unique()))}
        return [index[named[clip.name]] for clip in clips]

    def random_clusters(self, seed: int) -> pd.Series:
        """As many clusters of equal sizes at random: name -> cluster, training and held-out pieces apart."""
        generator = np.random.default_rng([seed, 18])
        parts = []
        for _, own in self.labels.groupby("split", sort=True):
            order = generator.permutation(len(own)) % len(self.clusters)
            parts.append(pd.Series([f"r{k}" for k in order], index=own["name"].to_numpy()))
        return pd.concat(parts)


def prepare(sources: Sequence[Path], out: Path, texts: Path | None = None, clusters: int = 0) -> Motions:
    """Read, hold out, filter and cluster the motions of `sources`; write `motions.npz` and `labels.csv` into `out`.

    Args:
        sources: a folder or archive each; its name is the group's.
        out: a new folder.
        texts: HumanML3D's folder, for the motions that it describes.
        clusters: how many; 0: as many as the elbow says.
    """
    from bumblebee.clustering.pipeline import cluster_clips

    config = ReadConfig(describe=DescribeConfig(humanml3d=str(texts or "")))
    kept, rows = [], []
    for source in sources:
        clips, _ = filter_clips(hold_out(read_folder(source, config).clips, SHARE))
        kept += clips
        rows += [Packed(source.stem, True, clip) for clip in clips]
    twice = pd.Series([clip.name for clip in kept]).duplicated()
    if twice.any():
        names = sorted({clip.name for clip, again in zip(kept, twice, strict=True) if again})
        raise BadInput("sources", "motions of different names", ", ".join(names[:3]), "Rename the files of one source.")
    if not clusters:
        found = cluster_clips(kept, ["c0", "c1"], CLUSTERING).summary["elbow"]["suggested_k"]
        if found is None:
            raise BadInput("clusters", "an elbow over K", "none", "Say --clusters.")
        clusters = int(found)
    result = cluster_clips(kept, [f"c{i}" for i in range(clusters)], CLUSTERING)
    out.mkdir(parents=True, exist_ok=True)
    write_pack(out / MOTIONS, rows)
    named = result.labels.set_index("name")["cluster"]
    table = [
        (c.name, motion_of(c.name), r.group, c.family, c.split, round(c.duration, 2), named[c.name])
        for r in rows
        for c in [r.clip]
    ]
    pd.DataFrame(table, columns=["name", "motion", "group", "family", "split", "seconds", "cluster"]).to_csv(
        out / LABELS, index=False
    )
    result.elbow.to_csv(out / "elbow.csv", index=False)
    (out / "clusters.txt").write_text("\n".join(_told(result.summary)) + "\n")
    return read_motions(out)


def read_motions(folder: Path) -> Motions:
    """Motions that `prepare` wrote.

    Raises:
        BadInput: if it is not there, or pieces and labels do not belong together.
    """
    folder = Path(folder)
    rows = read_pack(folder / MOTIONS)
    try:
        labels = pd.read_csv(folder / LABELS, keep_default_na=False)
        same = labels["name"].tolist() == [row.clip.name for row in rows]
    except (OSError, ValueError, KeyError) as error:
        raise BadInput(
            folder / LABELS, "labels of `benchmarks.study prepare`", f"{type(error).__name__}: {error}"
        ) from None
    if not same:
        raise BadInput(folder / LABELS, f"a row for each piece of {MOTIONS}", "other pieces", "Prepare them again.")
    clips = [
        replace(row, clip=replace(row.clip, split=split)) for row, split in zip(rows, labels["split"], strict=True)
    ]
    few = labels[labels["split"] == "train"].groupby("cluster")["motion"].nunique()
    for name, count in few.items():
        if count < 2:
            raise BadInput(f"{folder / LABELS}: cluster {name}", "at least 2 motions to learn from", str(count))
    return Motions(clips, labels, file_hash(folder / MOTIONS)[:12] + file_hash(folder / LABELS)[:12])


def _told(summary: dict) -> list[str]:
    """A line for each cluster."""
    return [
        f"{name}: {row['label']}; {row['clips']} pieces, {row['held_out_clips']} held out, {row['speed']:.2f} m/s"
        for name, row in summary["clusters"].items()
    ]
