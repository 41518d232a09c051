"""A card's table: successes by source and family, on two kinds of robots, by three rules."""

from pathlib import Path

import pandas as pd
import pytest

from benchmarks.baselines.by_family import read, table
from benchmarks.motion_pack import Packed
from bumblebee.errors import BadInput
from tests.tracking.clips import waving

MOTIONS = [Packed("asap", True, waving(name, family="walk")) for name in ("a", "b")]
MOTIONS += [Packed("cmu", True, waving("a", family=""))]  # a name that another source has, too


def trials(file: Path, kept: list[bool]) -> Path:
    rows = [
        {"name": row.clip.name, "family": row.clip.family, "policy": "imu", "kind": "itself", "success": done}
        for row, done in zip(MOTIONS, kept, strict=True)
    ]
    pd.DataFrame(rows).assign(success_local=True, success_upright=True).to_csv(file, index=False)
    return file


def test_each_family_and_source_counts_its_own_motions_by_each_rule(tmp_path: Path) -> None:
    declared = read(trials(tmp_path / "declared.csv", [True, False, False]), "imu", MOTIONS)
    drawn = read(trials(tmp_path / "drawn.csv", [False, False, False]), "imu", MOTIONS)
    lines = table({"declared": declared, "drawn": drawn}).splitlines()
    assert "declared: world | declared: own place | declared: pelvis | drawn: world" in lines[0]
    assert "| walk | 2 | 1 | 2 | 2 | 0 | 2 | 2 |" in lines and "| no family | 1 | 0 | 1 | 1 | 0 | 1 | 1 |" in lines
    assert any(line.startswith("| asap | 2 | 0.50 [") for line in lines)


def test_trials_of_another_policy_or_of_other_motions_are_a_line(tmp_path: Path) -> None:
    file = trials(tmp_path / "declared.csv", [True, True, True])
    with pytest.raises(BadInput, match="of imu"):
        read(file, "other", MOTIONS)
    with pytest.raises(BadInput, match="trials of the 2 motions"):
        read(file, "imu", MOTIONS[:2])
