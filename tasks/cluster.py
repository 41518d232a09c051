"""Cluster the kept motions by text and motion: data/filtered -> data/clusters, models/clustering."""

import json
from dataclasses import asdict
from pathlib import Path

from bumblebee.clustering.config import ClusterConfig
from bumblebee.clustering.pipeline import Clustering, cluster_clips
from bumblebee.errors import BadInput
from bumblebee.files import save_tensors
from bumblebee.motion.clip import Clip
from bumblebee.motion.store import read_library
from bumblebee.progress import progress
from tasks import paths
from tasks.sections import loop
from tasks.stage import load, log_run, output_folder, run_stage


def main() -> None:
    """Read the kept clips, cluster them, write labels, curves, summary and the autoencoder."""
    config, names = load("cluster", ClusterConfig), loop().clusters
    clips = kept_clips()
    with progress(config.epochs, "text-motion autoencoder", "epochs") as bar:
        result = cluster_clips(clips, names, config, lambda _, note: bar.update(1, note))
    with output_folder(paths.CLUSTERING) as folder:
        write_model(folder, result, config)
    with output_folder(paths.CLUSTERS) as folder:
        write_tables(folder, result)
    tell(result)
    curve = paths.CLUSTERS / "curve.csv"
    log_run(
        "cluster", params=config, metrics=metrics(result), curve=curve, artifacts=[paths.CLUSTERS, paths.CLUSTERING]
    )


def kept_clips() -> list[Clip]:
    """The clips that the filter kept."""
    clips = read_library(paths.FILTERED)
    if not clips:
        raise BadInput(
            paths.FILTERED / "index.parquet", "at least one kept motion", "none", f"See {paths.FILTERED / 'drops.csv'}"
        )
    return clips


def write_tables(folder: Path, result: Clustering) -> None:
    """labels.parquet, statistics.csv, elbow.csv, curve.csv, summary.json."""
    result.labels.to_parquet(folder / "labels.parquet", index=False)
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
    """Final numbers for MLflow."""
    audit, loss = result.summary["audit"], result.summary["loss"]
    numbers = {f"loss/{name}": value for name, value in loss.items()}
    numbers |= {f"stability/{name}": value for name, value in audit["stability"].items()}
    numbers |= {"k": result.summary["k"], "suggested_k": result.summary["suggested_k"]}
    if audit["family_ari"] is not None:
        numbers["family_ari"] = audit["family_ari"]
    return numbers


def tell(result: Clustering) -> None:
    """One line a cluster."""
    summary = result.summary
    print(f"{summary['k']} clusters (the elbow suggests {summary['suggested_k']})")
    for name, row in summary["clusters"].items():
        size = f"{row['clips']} clips, {row['held_out_clips']} held out"
        print(f"  {name}  {row['label']}: {size}, {row['speed']:.2f} m/s; {row['keywords'] or 'no keywords'}")
    if summary["moved_to_fill"]:
        print(f"  moved so that no cluster is too small: {', '.join(summary['moved_to_fill'])}")


if __name__ == "__main__":
    run_stage(main)
