"""The measured loop's benchmark: all four arms from a sealed robot to the tables, in parts, and held to its settings."""

import re
from pathlib import Path

import pytest

from benchmarks.measured_loop.__main__ import parse, run
from bumblebee.errors import BadInput

TINY = """
robots=[4604] motions=6 trial_motions=2 seconds=1.0 loses=0 stands=0 env.num_worlds=8 part=1 parent_parts=2 parts=1
learner.memory=8 learner.window=4 learner.horizon=2 learner.iterations=1 learner.model_updates=1 learner.warm_up=1
learner.policy_updates=1 learner.policy_batch=8 learner.model_batch=8 learner.model_hidden=[8] learner.value_hidden=[8]
residual.window=4 residual.updates=2 residual.batch=4 residual.hidden=[8] diagnosis.max_windows=12
diagnosis.max_holdout_windows=8 diagnosis.report_windows=8 diagnosis.search_seconds=0.1 diagnosis.beyond=false
""".split()


def called(out: Path, *more: str) -> None:
    run(parse(["--out", str(out), *more, "--set", *TINY]))


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run in two calls, the first of which is over at once."""
    out = tmp_path_factory.mktemp("loop")
    called(out, "--call-minutes", "0", "--until", "replay")
    assert (out / "robot-0.json").exists() and not (out / "seed-0").exists()
    called(out)
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


def test_what_is_done_is_not_done_again_and_other_settings_are_one_line(done: Path) -> None:
    files = {path: path.stat().st_mtime_ns for path in done.rglob("*") if path.is_file()}
    called(done)
    assert files == {path: path.stat().st_mtime_ns for path in done.rglob("*") if path.is_file()}
    with pytest.raises(BadInput, match="the settings and motions that the run began with"):
        run(parse(["--out", str(done), "--set", *TINY, "severity=0.5"]))


def test_a_folder_without_a_run_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(
        BadInput, match=r"expected a run with replay\.csv of a robot, came none\. Run it without --table"
    ):
        run(parse(["--out", str(tmp_path), "--table"]))
