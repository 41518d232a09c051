"""The stage `filter`: what breaks a rule is left out of data/filtered and explained in drops.csv."""

import errno
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from bumblebee.motion.clip import Clip
from bumblebee.motion.filter import DROP_COLUMNS
from bumblebee.motion.kinematics import lowest, make_clip
from bumblebee.motion.store import read_library, write_library, writer
from bumblebee.robot.facts import stand_pose
from tasks import filter as stage
from tasks import paths
from tasks.stage import run_stage


@pytest.fixture(autouse=True)
def workspace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("DVC_STAGE", raising=False)
    monkeypatch.setattr(stage, "log_run", lambda *_, **__: None)
    Path("params.yaml").write_text("filter: {floating: 0.1}")
    return tmp_path


def standing(name: str, height: float = 0.0) -> Clip:
    root_pos, root_quat = np.zeros((20, 3)), np.tile([1.0, 0, 0, 0], (20, 1))
    joint_pos = np.tile(stand_pose(), (20, 1))
    root_pos[:, 2] = height - lowest(root_pos, root_quat, joint_pos)
    return replace(make_clip(name, 50.0, root_pos, root_quat, joint_pos), split="test", family="stand")


def run(clips: list[Clip]) -> None:
    write_library(paths.MOTIONS, clips)
    run_stage(stage.main, [])


def test_what_floats_is_left_out_and_explained(capsys):
    run([standing("good"), standing("high", 0.3), standing("higher", 0.4)])
    (kept,) = read_library(paths.FILTERED)
    assert (kept.name, kept.split, kept.family) == ("good", "test", "stand")
    drops = pd.read_csv(paths.FILTERED / "drops.csv")
    assert tuple(drops.columns) == DROP_COLUMNS
    assert drops["motion"].tolist() == ["high", "higher"]
    assert set(drops["rule"]) == {"floating"}
    out = capsys.readouterr().out
    assert "1 of 3 clips kept, 2 dropped" in out and "floating: 2; the worst is higher" in out


def test_counts_add_up():
    clips = [standing("good"), standing("high", 0.3)]
    drops = stage.filter_clips(clips)[1]
    assert stage.metrics(2, drops) == {"kept": 1, "dropped": 1, "dropped/floating": 1.0}


def test_no_motion_left_ends_in_one_line_and_leaves_nothing(capsys):
    with pytest.raises(SystemExit) as caught:
        run([standing("high", 0.3)])
    assert caught.value.code == 2
    line = capsys.readouterr().err.strip()
    assert len(line.splitlines()) == 1 and "all 1 dropped; the first: high" in line
    assert not paths.FILTERED.exists()


def test_a_full_disk_leaves_the_old_result(capsys, monkeypatch):
    run([standing("good")])

    def full(path: Path, data: bytes) -> None:
        raise OSError(errno.ENOSPC, "No space left on device", str(path))

    write_library(paths.MOTIONS, [standing("new")])
    monkeypatch.setattr(writer, "put", full)
    with pytest.raises(SystemExit) as caught:
        run_stage(stage.main, [])
    assert caught.value.code == 2
    assert [clip.name for clip in read_library(paths.FILTERED)] == ["good"]
    assert sorted(path.name for path in Path("data").iterdir()) == ["filtered", "motions"]
