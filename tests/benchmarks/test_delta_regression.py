"""The benchmark of delta actions by regression: its robots can be sealed, and its table says what was judged."""

import json
from pathlib import Path

import pytest

from benchmarks.delta_regression import ROBOTS, fitted, main, sealed, table
from bumblebee.learning.delta.action import DeltaConfig, RegressionConfig
from bumblebee.stand_in.sealed import read_sealed
from tests.learning.swaying import ANKLES, record, weakened

CONFIG = DeltaConfig(num_envs=60, regression=RegressionConfig(windows=600, passes=2, folds=6))


@pytest.mark.parametrize("name", ROBOTS)
def test_each_robot_has_what_its_name_says(name: str, tmp_path: Path) -> None:
    effects = read_sealed(sealed(ROBOTS[name], tmp_path / "robot.json"))
    assert [effect["effect"] for effect in effects] == [kind for kind, _, _ in ROBOTS[name]]


def test_every_other_motion_judges(tmp_path: Path) -> None:
    rows = []
    for robot, share in (("weak", 0.6), ("declared", 1.0)):
        rollouts = record(24, 30, weakened(share, ANKLES), ANKLES)
        for number, rollout in enumerate(rollouts):
            rollout.meta["motion"] = f"m{number // 2:02d}"
        rows.append(json.loads(json.dumps({"robot": robot, **fitted(rollouts, CONFIG)})))
    weak, declared = rows
    assert (weak["learnt"], weak["rollouts"]) == (12, 12)
    assert weak["change"]["0.2"]["with"] < 0.5 * weak["change"]["0.2"]["without"]
    assert declared["change"]["0.2"]["with"] == declared["change"]["0.2"]["without"]
    lines = table(rows).splitlines()
    assert len(lines) == 4 and "nothing corrected" in lines[3] and "nothing corrected" not in lines[2]


def test_another_file_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "x").write_text("a table\n")
    assert main(["--motions", str(tmp_path / "none"), "--out", str(tmp_path / "x")]) == 2
    assert "expected lines of JSON of this benchmark" in capsys.readouterr().out
    assert (tmp_path / "x").read_text() == "a table\n"
