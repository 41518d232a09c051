"""Columns and rows without a number: what is optional is left out with a note, what is needed is refused."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from bumblebee.errors import BadInput
from bumblebee.measured.checks import check_rollout
from bumblebee.measured.importers import read_rollouts
from bumblebee.measured.importers.map_file import read_map
from bumblebee.measured.rollout import Rollout
from tests.commands.conftest import run
from tests.measured.importers.remedies.walk import HINGES, model_of, table

MAP = """
joints: [hip, knee]
columns:
  joint_pos: [hip_pos, knee_pos]
  joint_vel: [hip_vel, knee_vel]
  joint_target: [hip_cmd, knee_cmd]
  joint_torque: [hip_eff, knee_eff]
"""


def log() -> pd.DataFrame:
    made = table()
    for joint in ("hip", "knee"):
        made[f"{joint}_vel"] = np.gradient(made[f"{joint}_pos"], made["time"])
        made[f"{joint}_eff"] = 1.0
    return made


def imported(folder: Path, made: pd.DataFrame, text: str = MAP) -> Rollout:
    made.to_csv(folder / "log.csv", index=False)
    (folder / "map.yaml").write_text(text)
    (rollout,) = read_rollouts(folder / "log.csv", "csv", column_map=folder / "map.yaml")
    return rollout


def test_an_optional_column_without_any_number_is_left_out_with_a_note(tmp_path: Path) -> None:
    ours = imported(tmp_path, log().assign(hip_eff=np.nan, knee_eff=np.nan))
    assert ours.joint_torque is None and "joint_torque left out: no number in any row" in ours.meta["notes"]
    assert not [finding for finding in check_rollout(ours, model_of(HINGES)) if finding.fatal]


def test_an_optional_column_without_numbers_of_one_joint_is_left_out_and_names_it(tmp_path: Path) -> None:
    ours = imported(tmp_path, log().assign(knee_eff=np.nan))
    assert ours.joint_torque is None and "joint_torque left out: no number of knee in any row" in ours.meta["notes"]


def test_velocities_without_any_number_are_made_of_the_positions(tmp_path: Path) -> None:
    ours = imported(tmp_path, log().assign(hip_vel=np.nan, knee_vel=np.nan))
    np.testing.assert_allclose(ours.joint_vel, np.gradient(ours.joint_pos, ours.time, axis=0))
    assert "joint_vel was not logged" in ours.meta["notes"]


def test_the_command_prints_each_note_once(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "logs").mkdir()
    for name in ("a", "b"):
        log().assign(hip_eff=np.nan, knee_eff=np.nan).to_csv(tmp_path / "logs" / f"{name}.csv", index=False)
    (tmp_path / "map.yaml").write_text(MAP + 'meta: {notes: "left\\e[31m hand"}\n')
    assert run("import", tmp_path / "logs", tmp_path / "out", "--kind", "csv", "--columns", tmp_path / "map.yaml") == 0
    said = capsys.readouterr().out
    assert said.count("note (2 rollouts): joint_torque left out: no number in any row\n") == 1
    assert "left\ufffd[31m hand" in said


@pytest.mark.parametrize("column", ["knee_pos", "knee_cmd"])
def test_a_needed_column_without_any_number_is_one_line(tmp_path: Path, column: str) -> None:
    with pytest.raises(BadInput, match="expected numbers, came no number of knee in any row"):
        imported(tmp_path, log().assign(**{column: np.nan}))


def test_rows_without_a_number_are_left_out_where_the_map_says_so(tmp_path: Path) -> None:
    made = log()
    made.loc[[3, 4], "knee_eff"] = np.nan
    ours = imported(tmp_path, made, MAP + "rows: complete\n")
    assert ours.frames == 98 and "2 rows without a number left out" in ours.meta["notes"]


QUAT = (
    "joints: [hip]\ncolumns: {joint_pos: [hip_pos], joint_target: [hip_cmd], base_quat: [NAMES]}\nquat_order: ORDER\n"
)


@pytest.mark.parametrize(
    ("names", "order", "named"),
    [
        ("qw, qw, qy, qz", "xyzw", "base_quat: expected each component once, came qw, qw, qy, qz"),
        ("qw, qx, qy, qz", "xyzw", "came xyzw beside qw, qx, qy, qz. `quat_order: wxyz`"),
        ("rot_x_imu, rot_y_imu, rot_z_imu, rot_w_imu", "wxyz", "`quat_order: xyzw`"),
    ],
)
def test_a_quaternion_s_names_must_be_all_four_in_the_order_that_the_map_states(
    tmp_path: Path, names: str, order: str, named: str
) -> None:
    (tmp_path / "map.yaml").write_text(QUAT.replace("NAMES", names).replace("ORDER", order))
    with pytest.raises(BadInput) as error:
        read_map(tmp_path / "map.yaml")
    assert named in str(error.value)


@pytest.mark.parametrize("names", ["qw, qz, qx, qy", "q0, q1, q2, q3", "a, b, c, d"])
def test_exchanged_axes_and_names_without_letters_are_taken_as_stated(tmp_path: Path, names: str) -> None:
    (tmp_path / "map.yaml").write_text(QUAT.replace("NAMES", names).replace("ORDER", "wxyz"))
    assert len(read_map(tmp_path / "map.yaml").columns["base_quat"]) == 4


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("log,kp,kp\nlog,40,30\n", "column kp: expected every column once"),
        ("log,kp\nlog,true\n", "kp: expected a number for every joint, came ['true', 'true']"),
        ("log,supply_voltage\nlog,TRUE\n", "supply_voltage: expected a number of volts"),
    ],
)
def test_conditions_that_stand_twice_or_are_truth_values_are_one_line(tmp_path: Path, text: str, named: str) -> None:
    log().to_csv(tmp_path / "log.csv", index=False)
    (tmp_path / "map.yaml").write_text(MAP)
    (tmp_path / "conditions.csv").write_text(text)
    with pytest.raises(BadInput) as error:
        read_rollouts(tmp_path / "log.csv", "csv", None, tmp_path / "map.yaml", tmp_path / "conditions.csv")
    assert named in str(error.value)


def test_a_truth_value_is_a_label_as_it_was_written(tmp_path: Path) -> None:
    log().to_csv(tmp_path / "log.csv", index=False)
    (tmp_path / "map.yaml").write_text(MAP)
    (tmp_path / "conditions.csv").write_text("log,warm\nlog,true\n")
    (ours,) = read_rollouts(tmp_path / "log.csv", "csv", None, tmp_path / "map.yaml", tmp_path / "conditions.csv")
    assert ours.meta["conditions"] == {"warm": "true"}
