"""The stage `filter`: what breaks a rule is left out of data/filtered and explained in drops.csv."""

import errno
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml

from bumblebee.errors import BadInput
from bumblebee.motion.clip import Clip
from bumblebee.motion.filters.rules import DROP_COLUMNS
from bumblebee.motion.kinematics import lowest, make_clip
from bumblebee.motion.store import read_library, write_library, writer
from bumblebee.robot.facts import stand_pose
from tasks import filter as stage
from tasks.policies.policy_filter import PolicyFilter
from tasks.running import paths
from tasks.running.stage import run_stage


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


def raised_and_sunk(name: str) -> Clip:
    """Deep under the floor at first, high over it for longer than a second after."""
    root_quat, joint_pos = np.tile([1.0, 0, 0, 0], (100, 1)), np.tile(stand_pose(), (100, 1))
    root_pos = np.zeros((100, 3))
    root_pos[:, 2] = np.interp(np.arange(100), [0, 10, 30], [-0.2, -0.2, 0.4]) - lowest(root_pos, root_quat, joint_pos)
    return make_clip(name, 50.0, root_pos, root_quat, joint_pos)


def settings(line: str) -> None:
    Path("params.yaml").write_text(f"filter: {{floating: 0.1, {line}}}")


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


def test_counts_add_up_and_every_motion_has_its_decision(capsys):
    both = raised_and_sunk("both")
    run([standing("good"), standing("high", 0.3), both])
    table = pd.read_csv(paths.FILTERED / "decisions.csv").set_index("motion")
    assert table["decision"].to_dict() == {"good": "keep", "high": "drop", "both": "drop"}
    assert table.loc["both", "rules"] == "floor_penetration;airborne"
    assert table.loc["both", "value"] == pytest.approx(0.2, abs=1e-3)  # of the first
    out = capsys.readouterr().out
    assert "dropped by first reason: floating 1, floor_penetration 1; together 2" in out
    assert "airborne: 1; the worst is both" in out


def test_a_persons_word_overrules_and_both_verdicts_stay_on_record(capsys):
    settings("overrule: word.csv")
    Path("word.csv").write_text("motion,decision,reason,who\nhigh,keep,on a table,Ada\ngood,drop,limps,Bob\n")
    run([standing("good"), standing("high", 0.3), standing("fine")])
    assert [clip.name for clip in read_library(paths.FILTERED)] == ["high", "fine"]
    table = pd.read_csv(paths.FILTERED / "decisions.csv").set_index("motion").fillna("")
    assert table[["decision", "by_rules", "overruled_by"]].to_numpy().tolist() == [
        ["drop", "keep", "Bob"],
        ["keep", "drop", "Ada"],
        ["keep", "keep", ""],
    ]
    drops = pd.read_csv(paths.FILTERED / "drops.csv")
    assert drops[["motion", "rule", "explanation"]].to_numpy().tolist() == [["good", "overruled", "Bob: limps"]]
    assert "overruled: high: keep, against the rules (Ada: on a table)" in capsys.readouterr().out


def test_a_word_about_an_unknown_motion_ends_in_one_line_with_the_nearest_names(capsys):
    settings("overrule: word.csv")
    Path("word.csv").write_text("motion,decision,reason,who\nhihg,keep,on a table,Ada\n")
    with pytest.raises(SystemExit) as caught:
        run([standing("good"), standing("high", 0.3)])
    assert caught.value.code == 2
    line = capsys.readouterr().err.strip().splitlines()[-1]
    assert "'hihg'; the nearest: high" in line and not paths.FILTERED.exists()


@pytest.mark.parametrize(("deps", "refused"), [([], True), (["word.csv"], False)])
def test_a_file_that_dvc_does_not_look_at_is_refused(monkeypatch, deps: list[str], refused: bool):
    Path("dvc.yaml").write_text(yaml.safe_dump({"stages": {"filter": {"deps": ["data/motions", *deps]}}}))
    monkeypatch.setenv("DVC_STAGE", "filter")
    config = stage.FilterStageConfig(overrule="word.csv", policy=PolicyFilter(source="shipped"))
    if refused:
        with pytest.raises(BadInput, match="Add it to the deps of the stage filter"):
            stage.require_tracked(config)
    else:
        stage.require_tracked(config)


def test_a_policy_drops_what_it_cannot_follow_and_is_not_asked_about_what_the_rules_drop(monkeypatch):
    settings("policy: {source: anything, at_once: 2}")
    asked = []

    @contextmanager
    def loaded(config):
        yield config.source

    def unfollowed(policy, clips, config, on_tick):
        asked.append([clip.name for clip in clips])
        row = {"motion": "b", "rule": "policy", "value": 0.6, "limit": 0.5, "unit": "m", "explanation": "lost"}
        return {"b": row} if "b" in asked[-1] else {}

    monkeypatch.setattr(stage, "loaded", loaded)
    monkeypatch.setattr(stage, "unfollowed", unfollowed)
    run([standing("a"), standing("high", 0.3), standing("b"), standing("c")])
    assert asked == [["a", "b"], ["c"]]
    assert [clip.name for clip in read_library(paths.FILTERED)] == ["a", "c"]
    drops = pd.read_csv(paths.FILTERED / "drops.csv")
    assert drops[["motion", "rule"]].to_numpy().tolist() == [["high", "floating"], ["b", "policy"]]


def test_no_motion_left_ends_in_one_line_and_leaves_nothing(capsys):
    with pytest.raises(SystemExit) as caught:
        run([standing("high", 0.3)])
    assert caught.value.code == 2
    line = capsys.readouterr().err.strip()
    assert len(line.splitlines()) == 1 and "all 1 dropped; the first: high" in line
    assert not paths.FILTERED.exists()


def test_a_library_of_nothing_ends_in_one_line(capsys):
    write_library(paths.MOTIONS, [])
    with pytest.raises(SystemExit) as caught:
        run_stage(stage.main, [])
    assert caught.value.code == 2 and "a library of none" in capsys.readouterr().err


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
