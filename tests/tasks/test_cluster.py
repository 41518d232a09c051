"""The stage `cluster`: every kept clip gets a cluster of params.yaml, and the files are whole or not there."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import torch

from bumblebee.clustering.autoencoder import AutoencoderConfig, TextMotionAutoencoder
from bumblebee.motion.clip import Clip
from bumblebee.motion.kinematics import make_clip
from bumblebee.motion.store import write_library
from bumblebee.robot.facts import stand_pose
from tasks import cluster as stage
from tasks import paths
from tasks.stage import run_stage

PARAMS = """
clusters: [slow, quick]
rounds: []
final_round: 0
cluster: {hidden: 8, layers: 1, heads: 2, latent: 4, epochs: 3, max_k: 3, audit_seeds: 2}
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
