"""The stage `cluster`: every kept clip gets a cluster of params.yaml, and the files are whole or not there."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import torch

from bumblebee.clustering.autoencoder import AutoencoderConfig, TextMotionAutoencoder
from bumblebee.clustering.config import ClusterConfig
from bumblebee.motion.clip import Clip
from bumblebee.motion.kinematics import make_clip
from bumblebee.motion.store import write_library
from bumblebee.robot.facts import stand_pose
from tasks import cluster as stage
from tasks.running import paths
from tasks.running.stage import run_stage

PARAMS = """
clusters: [slow, quick]
rounds: []
final_round: 0
cluster: {hidden: 8, layers: 1, heads: 2, latent: 4, epochs: 3, max_k: 3, audit_seeds: 2, audit_retrain: 1}
"""


@pytest.fixture(autouse=True)
def workspace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("DVC_STAGE", raising=False)
    monkeypatch.setattr(stage, "log_run", lambda *_, **__: None)
    Path("params.yaml").write_text(PARAMS)
    return tmp_path


def gliding(name: str, speed: float, split: str = "train") -> Clip:
    """Without captions, so that no text encoder is loaded."""
    time = np.arange(60) / 50.0
    root_pos = np.stack([speed * time, 0 * time, np.full(60, 0.78)], 1)
    return make_clip(
        name, 50.0, root_pos, np.tile([1.0, 0, 0, 0], (60, 1)), np.tile(stand_pose(), (60, 1)), split=split
    )


def run() -> None:
    run_stage(stage.main, [])


def test_every_kept_clip_has_a_cluster_and_the_weights_load(capsys):
    clips = [gliding(f"m{i}", 0.3 * i, "test" if i == 5 else "train") for i in range(6)]
    write_library(paths.FILTERED, clips)
    run()
    labels = pd.read_parquet(paths.CLUSTERS / "labels.parquet")
    assert labels["name"].tolist() == [clip.name for clip in clips]
    assert set(labels["cluster"]) == {"slow", "quick"} and np.isfinite(labels[["x", "y"]]).all(axis=None)
    summary = json.loads((paths.CLUSTERS / "summary.json").read_text())
    assert list(summary["clusters"]) == ["slow", "quick"]
    assert summary["clusters"]["slow"]["speed"] < summary["clusters"]["quick"]["speed"]
    assert pd.read_csv(paths.CLUSTERS / "elbow.csv")["k"].tolist() == [1, 2, 3]
    assert len(pd.read_csv(paths.CLUSTERS / "curve.csv")) == 3
    points = pd.read_parquet(paths.CLUSTERS / "map.parquet")
    assert points["name"].tolist() == labels["name"].tolist() and points["poses"].str.len().eq(4 * 15 * 2).all()
    facts = json.loads((paths.CLUSTERING / "config.json").read_text())["autoencoder"]
    model = TextMotionAutoencoder(AutoencoderConfig(**facts))
    model.load_state_dict(torch.load(paths.CLUSTERING / "autoencoder.pt", weights_only=True))
    assert "slow" in capsys.readouterr().out


def test_too_few_motions_end_in_one_line_and_leave_nothing(capsys):
    write_library(paths.FILTERED, [gliding("a", 0.0), gliding("b", 1.0), gliding("c", 1.0)])
    with pytest.raises(SystemExit) as ended:
        run()
    assert ended.value.code == 2
    said = capsys.readouterr().err.strip()
    assert said.count("\n") == 0 and "2 x 2 training clips" in said and "3 training clips" in said
    assert not paths.CLUSTERS.exists() and not paths.CLUSTERING.exists()


def test_unknown_setting_is_named(capsys):
    Path("params.yaml").write_text(PARAMS.replace("epochs", "epoch"))
    with pytest.raises(SystemExit):
        run()
    assert "cluster.epoch" in capsys.readouterr().err


def test_random_clusters_are_named_as_such_and_fill_the_same_files(capsys):
    Path("params.yaml").write_text(PARAMS.replace("cluster: {", "cluster: {method: random, "))
    write_library(paths.FILTERED, [gliding(f"m{i}", 0.3 * i) for i in range(6)])
    run()
    labels = pd.read_parquet(paths.CLUSTERS / "labels.parquet")
    assert labels["cluster"].value_counts().tolist() == [3, 3]
    summary = json.loads((paths.CLUSTERS / "summary.json").read_text())
    assert summary["method"] == "random" and "at random" in capsys.readouterr().out
    assert {path.name for path in paths.CLUSTERING.iterdir()} == {"autoencoder.pt", "config.json"}


def test_clips_are_read_in_parts_and_none_is_left_out(monkeypatch):
    monkeypatch.setattr(stage, "_AT_ONCE", 4)
    write_library(paths.FILTERED, [gliding(f"m{i}", 0.1 * i) for i in range(9)])
    assert [own.name for own in stage.kept_material(ClusterConfig())] == [f"m{i}" for i in range(9)]


@pytest.mark.parametrize(
    ("suggested", "k", "said"),
    [(3, 3, ""), (4, 2, "names 2 clusters, the elbow over K from 1 to 10 suggests 4"), (None, 2, "has no elbow")],
)
def test_another_number_than_the_elbows_is_said_with_what_to_write(suggested, k, said):
    bend = {"suggested_k": suggested, "k": k, "rule": "kneedle", "from": 1, "to": 10, "silhouette_k": 3}
    line = stage.elbow_line({"k": k, "elbow": bend})
    assert said in line and bool(line) == bool(said)
    assert ("[c0, c1, c2, c3]" in line) == (suggested == 4)


def test_every_figure_is_a_metric_with_its_interval_and_a_name_that_mlflow_takes():
    tree = {"retrieval": {"R@1": {"value": 0.5, "ci95": [0.2, 0.8], "n": 9, "chance": 0.1}, "few": True}, "none": None}
    assert dict(stage.figures(tree)) == {
        "retrieval/R_1": 0.5, "retrieval/R_1/ci95.low": 0.2, "retrieval/R_1/ci95.high": 0.8, "retrieval/R_1/n": 9.0,
        "retrieval/R_1/chance": 0.1,
    }  # fmt: skip
    assert dict(stage.figures({"a": {"value": None, "ci95": [None, None], "n": 0}})) == {"a/n": 0.0}
