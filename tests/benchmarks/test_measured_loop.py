"""The measured loop's benchmark: four arms from a sealed robot to the tables, in parts, held to its settings."""

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest

from benchmarks.measured_loop import work
from benchmarks.measured_loop.__main__ import parse, run
from bumblebee.errors import BadInput
from bumblebee.measured.rollout import Rollout
from bumblebee.motion.clip import Clip
from bumblebee.policy.episodes import Episode
from tests.learning.swaying import ANKLES, record, weakened
from tests.tracking.clips import waving

TINY = [
    "robots=[4604]",
    "motions=6",
    "trial_motions=2",
    "seconds=1.0",
    "loses=0",
    "stands=0",
    "env.num_worlds=8",
    "part=1",
    "parent_parts=2",
    "parts=1",
    "learner.window=4",
    "learner.memory=8",
    "learner.horizon=2",
    "learner.iterations=1",
    "learner.model_updates=1",
    "learner.warm_up=1",
    "learner.policy_updates=1",
    "learner.policy_batch=8",
    "learner.model_batch=8",
    "learner.model_hidden=[8]",
    "residual.window=4",
    "residual.updates=2",
    "residual.batch=4",
    "residual.hidden=[8]",
    "diagnosis.max_windows=12",
    "diagnosis.max_holdout_windows=8",
    "diagnosis.report_windows=8",
    "diagnosis.search_seconds=0.1",
    "diagnosis.beyond=false",
]


def called(out: Path, *more: str) -> None:
    run(parse(["--out", str(out), *more, "--set", *TINY]))


def on_robot(
    policy: Path, robot: Path, clips: Sequence[Clip], episodes: Sequence[Episode], *_: object
) -> list[Rollout]:
    """A weak robot that sways, in place of the stand-in's process."""
    assert policy.exists() and robot.exists()
    made = record(len(episodes), 45, weakened(0.5, ANKLES), ANKLES)
    pairs = zip(made, episodes, strict=True)
    return [replace(own, rollout_id=e.rollout_id, meta={"motion": e.motion}) for own, e in pairs]


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run in two calls, the first of which is over at once, and a third that finds all done."""
    out = tmp_path_factory.mktemp("loop")
    clips = [waving(f"m{i}", 50, speed=0.2 + 0.1 * i) for i in range(7)]
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(work, "make_library", lambda: clips)
        patched.setattr(work, "found", lambda config, motions: {"seed": config.seed})
        patched.setattr(work, "run_on_robot", on_robot)
        called(out, "--call-minutes", "0", "--until", "replay")
        assert (out / "robot-0.json").exists() and not (out / "seed-0").exists()
        called(out)
        files = {path: path.stat().st_mtime_ns for path in out.rglob("*") if path.is_file()}
        called(out)  # nothing is done again
        assert files == {path: path.stat().st_mtime_ns for path in out.rglob("*") if path.is_file()}
    return out


def test_the_tables_have_every_arm_with_intervals_by_readings_and_by_the_truth(
    done: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run(parse(["--out", str(done), "--table"]))
    told = capsys.readouterr().out
    for model in ("declared", "corrected", "declared + residual", "corrected + residual"):
        assert len(re.findall(rf"\| robot-0 \| {re.escape(model)} \| (?:0.02|0.2|0.6) \|", told)) == 3
    assert len(re.findall(r"\| robot-0 \| (?:recorded|held out) \| (?:none|physics|residual|both) \| 0|1", told)) >= 8
    assert "dropped: " in told or "kept" in told


def test_other_settings_are_one_line(done: Path) -> None:
    with pytest.raises(BadInput, match="the settings and motions that the run began with"):
        run(parse(["--out", str(done), "--set", *TINY, "severity=0.5"]))


def test_a_folder_without_a_run_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(
        BadInput, match=r"expected a run with replay\.csv of a robot, came none\. Run it without --table"
    ):
        run(parse(["--out", str(tmp_path), "--table"]))
