"""The import says in which unit joints were read, how it was known and the key that says otherwise; it is kept."""

import json
import re
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from bumblebee.cli import run
from bumblebee.measured.metadata import METADATA_KEY
from bumblebee.measured.rollout import read_rollout

MAP = "joints: [hip, knee]\ntime: t\ncolumns: {joint_pos: [q1, q2], joint_target: [u1, u2]}\n"


@pytest.fixture
def logs(tmp_path: Path) -> Path:
    for name, largest in (("one", 40), ("two", 90)):
        rows = [f"{0.02 * k:.2f},{-30 + k},{largest * k / 19:.6f},10,20" for k in range(20)]
        (tmp_path / "logs").mkdir(exist_ok=True)
        (tmp_path / "logs" / f"{name}.csv").write_text("\n".join(["t,q1,q2,u1,u2", *rows]))
    return tmp_path / "logs"


def imported(logs: Path, text: str, name: str) -> Path:
    (logs.parent / "map.yaml").write_text(text)
    out = logs.parent / name
    assert run(["import", str(logs), str(out), "--kind", "csv", "--columns", str(logs.parent / "map.yaml")]) == 0
    return out


def first(dataset: Path) -> np.ndarray:
    return read_rollout(dataset / "rollouts" / "two.parquet").joint_pos


@pytest.mark.parametrize(
    ("stated", "how", "span"),
    [
        ("angle_unit: deg\n", "in deg and turned to rad, as `angle_unit`", "-30 to 90 deg"),
        ("", "in rad (m of slides), since the map has no `angle_unit`", "-30 to 90"),
        ("angle_unit: [m, deg]\n", "in deg and turned", "-30 to -11 m, 0 to 90 deg"),
        ("angle_unit: deg\nscale: {joint_pos: [2, 0.5]}\noffset: {joint_pos: 1}\n", "in deg", "-30 to 90 deg"),
    ],
)
def test_one_line_tells_unit_evidence_and_remedy_and_stands_in_the_metadata(
    logs: Path, stated: str, how: str, span: str, capsys: pytest.CaptureFixture[str]
) -> None:
    out = imported(logs, MAP + stated, "out")
    (line,) = [line for line in capsys.readouterr().out.splitlines() if "angle_unit" in line]
    assert line.startswith("note (2 rollouts): joints read ") and how in line and f"goes from {span}. If" in line
    for name in ("one", "two"):
        kept = json.loads(pq.read_schema(out / "rollouts" / f"{name}.parquet").metadata[METADATA_KEY])
        assert line.removeprefix("note (2 rollouts): ") in kept["notes"].split("; ")


@pytest.mark.parametrize("stated", ["angle_unit: deg\n", "", "angle_unit: [m, deg]\n"])
def test_the_key_that_says_otherwise_does_as_printed(
    logs: Path, stated: str, capsys: pytest.CaptureFixture[str]
) -> None:
    before = first(imported(logs, MAP + stated, "out"))
    (key,) = re.findall(r"write `(angle_unit: [^`]*)` in the map", capsys.readouterr().out)
    after = first(imported(logs, f"{MAP}{key}\n", "again"))
    factor = 180 / np.pi if stated else np.pi / 180
    np.testing.assert_allclose(after[:, 1], factor * before[:, 1])


def test_a_map_that_states_the_contracts_units_needs_no_line(logs: Path, capsys: pytest.CaptureFixture[str]) -> None:
    imported(logs, MAP + "angle_unit: rad\n", "out")
    assert "angle_unit" not in capsys.readouterr().out


def test_a_gyroscope_that_follows_the_joints_unit_is_told_too(logs: Path, capsys: pytest.CaptureFixture[str]) -> None:
    columns = MAP.replace("{joint_pos", "{base_ang_vel: [q1, q2, u1], joint_pos")
    imported(logs, columns + "angle_unit: deg\n", "out")
    assert "base_ang_vel in deg/s (`gyro_unit`)" in capsys.readouterr().out
