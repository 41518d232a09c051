"""Cluster the kept motions by text and motion: data/filtered -> data/clusters, models/clustering."""

import json
import re
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

from bumblebee.clustering.config import ClusterConfig
from bumblebee.clustering.material import Material, gather
from bumblebee.clustering.pipeline import Clustering, cluster, enough, epochs_of, texts_of
from bumblebee.errors import BadInput
from bumblebee.files import save_tensors
from bumblebee.motion.clip import Clip
from bumblebee.motion.store import read_index, read_library
from bumblebee.progress import progress
from tasks.running import paths
from tasks.running.stage import load, log_run, output_folder, run_stage
from tasks.sections import loop

MLFLOW = re.compile(r"[^A-Za-z0-9_./ -]")  # what it takes in no name
_AT_ONCE = 256  # clips in memory while their features are made


def main() -> None:
    """Read the kept clips, cluster them, write labels, curves, summary and the autoencoder."""
    config, names = load("cluster", ClusterConfig), loop().clusters
    materials = kept_material(config)
    enough(materials, names, config)
    table = texts_of(materials, config)
    with progress(epochs_of(materials, config), "text-motion autoencoder", "epochs") as bar:
        result = cluster(materials, names, config, lambda _, note: bar.update(1, note), table)
    with output_folder(paths.CLUSTERING) as folder:
        write_model(folder, result, config)
    with output_folder(paths.CLUSTERS) as folder:
        write_tables(folder, result)
    tell(result)
    curve = paths.CLUSTERS / "curve.csv"
    log_run("cluster", params=config, metrics=metrics(result), curve=curve)


def kept_material(config: ClusterConfig) -> list[Material]:
    """Features and texts of the clips that the filter kept, of which only so many are in memory at a time."""
    names = read_index(paths.FILTERED)["name"].tolist()
    if not names:
        raise BadInput(
            paths.FILTERED / "index.parquet", "at least one kept motion", "none", f"See {paths.FILTERED / 'drops.csv'}"
        )
    with progress(len(names), "features", "motions") as bar:

        def read() -> Iterator[Clip]:
            for start in range(0, len(names), _AT_ONCE):
                part = read_library(paths.FILTERED, names[start : start + _AT_ONCE])
                yield from part
                bar.update(len(part))

        return gather(read(), config)


def write_tables(folder: Path, result: Clustering) -> None:
    """labels.parquet, statistics.csv, elbow.csv, curve.csv, map.parquet, summary.json."""
    result.labels.to_parquet(folder / "labels.parquet", index=False)
    result.points.to_parquet(folder / "map.parquet", index=False)
    result.statistics.to_csv(folder / "statistics.csv", index=False)
    result.elbow.to_csv(folder / "elbow.csv", index=False)
    result.curve.to_csv(folder / "curve.csv", index=False)
    (folder / "summary.json").write_text(json.dumps(result.summary, indent=2) + "\n")


def write_model(folder: Path, result: Clustering, config: ClusterConfig) -> None:
    """Weights alone, to be read with `weights_only=True`, and what is needed to build the network and its features."""
    save_tensors(folder / "autoencoder.pt", result.model.state_dict())
    facts = {"autoencoder": result.model.config.as_dict(), "cluster": asdict(config)}
    (folder / "config.json").write_text(json.dumps(facts, indent=2) + "\n")


def metrics(result: Clustering) -> dict[str, float]:
    """Every figure of the summary by its path, for MLflow; its interval beside it as `.low` and `.high`."""
    summary = result.summary
    told = {key: summary[key] for key in ("audit", "retrieval", "elbow", "clips", "loss", "clusters")}
    return {"k": summary["k"], **dict(figures(told))}


def figures(tree: dict[str, Any], path: str = "") -> Iterator[tuple[str, float]]:
    """The numbers of a nested mapping, each with its path."""
    for key, value in tree.items():
        place = f"{path}{MLFLOW.sub('_', str(key))}"
        if key == "value" and value is not None:
            yield path.rstrip("/"), float(value)
        elif isinstance(value, dict):
            yield from figures(value, f"{place}/")
        elif isinstance(value, list) and len(value) == 2 and None not in value and key.endswith("95"):
            yield from ((f"{place}.low", float(value[0])), (f"{place}.high", float(value[1])))
        elif isinstance(value, int | float) and not isinstance(value, bool):
            yield place, float(value)


def tell(result: Clustering) -> None:
    """One line a cluster, and one where the elbow suggests another number."""
    summary = result.summary
    at_random = ", at random, of equal sizes" if summary["method"] == "random" else ""
    print(f"{summary['k']} clusters{at_random}")
    for name, row in summary["clusters"].items():
        size = f"{row['clips']} clips, {row['held_out_clips']} held out"
        print(f"  {name}  {row['label']}: {size}, {row['speed']:.2f} m/s; {row['keywords'] or 'no keywords'}")
    if line := elbow_line(summary):
        print(line)
    if summary["moved_to_fill"]:
        print(f"  moved so that no cluster is too small: {', '.join(summary['moved_to_fill'])}")


def elbow_line(summary: dict[str, Any]) -> str:
    """Line on another K than the elbow's and what to do; "" where both are the same."""
    bend, k = summary["elbow"], summary["k"]
    over = f"K from {bend['from']} to {bend['to']}"
    if bend["suggested_k"] is None:
        return f"the curve over {over} has no elbow, so nothing speaks for or against {k} clusters there"
    if bend["suggested_k"] == k:
        return ""
    names = ", ".join(f"c{i}" for i in range(bend["suggested_k"]))
    return (
        f"params.yaml names {k} clusters, the elbow over {over} suggests {bend['suggested_k']} "
        f"({bend['rule']}): to follow it, write `clusters: [{names}]`"
    )


if __name__ == "__main__":
    run_stage(main)
