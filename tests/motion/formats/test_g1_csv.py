"""CSV files of the G1 come back as they were written, and a bad cell is named by its place."""

import numpy as np
import pytest

from bumblebee.errors import BadInput
from bumblebee.motion.formats.config import RobotConfig
from bumblebee.motion.formats.g1_csv import read_g1_csv
from bumblebee.motion.reading.folder import ReadConfig, read_file
from bumblebee.robot.facts import joint_names


@pytest.mark.parametrize("dof", [29, 23])
def test_round_trip(motions, dof):
    raw = motions.raw()
    came = read_g1_csv(motions.csv(raw, dof=dof), 30.0, options=RobotConfig(joints_23="asap"))
    for name in ("root_pos", "root_quat", "joint_pos"):
        np.testing.assert_allclose(getattr(came, name), getattr(raw, name), atol=1e-8)
    assert came.fps == 30.0 and came.name == "sway"


def test_wrist_columns_are_dropped_by_name_not_by_place(motions):
    raw = motions.raw()
    path = motions.csv(raw)
    table = np.loadtxt(path, delimiter=",")
    wrists = [7 + i for i, name in enumerate(joint_names(every=True)) if "wrist" in name]
    table[:, wrists] = 1.5
    np.savetxt(path, table, delimiter=",")
    np.testing.assert_allclose(read_g1_csv(path, 30).joint_pos, raw.joint_pos, atol=1e-8)


def test_a_header_decides_the_order_of_the_joints(motions):
    raw = motions.raw()
    path = motions.csv(raw, dof=23)
    table = np.loadtxt(path, delimiter=",")
    order = np.random.default_rng(0).permutation(23)
    header = ",".join([*"xyzabcd", *(joint_names()[i].removesuffix("_joint") for i in order)])
    np.savetxt(path, table[:, [*range(7), *(7 + order)]], delimiter=",", header=header, comments="")
    np.testing.assert_allclose(read_g1_csv(path, 30).joint_pos, raw.joint_pos, atol=1e-8)


def test_an_unknown_joint_is_named(motions):
    names = [*joint_names()]
    names[3] = "left_tail_joint"
    path = motions.csv(motions.raw(), dof=23, header=",".join([*"xyzabcd", *names]))
    with pytest.raises(
        BadInput, match=r"row 1, column 11: expected the name of a joint of g1_23dof, came unknown joint 'left_tail"
    ):
        read_g1_csv(path, 30)


def test_a_missing_joint_is_named(motions):
    path = motions.csv(motions.raw(), dof=23, header=",".join([*"xyzabcd", *joint_names()[:-1], "left_wrist_yaw"]))
    with pytest.raises(BadInput, match="right_elbow_joint"):
        read_g1_csv(path, 30)


@pytest.mark.parametrize("columns", [35, 37, 29, 1])
def test_a_wrong_number_of_columns_is_said(tmp_path, columns):
    np.savetxt(tmp_path / "a.csv", np.zeros((20, columns)), delimiter=",")
    with pytest.raises(BadInput, match=rf"a\.csv, row 1: expected 36 columns .*, came {columns} column"):
        read_g1_csv(tmp_path / "a.csv", 30)


def test_a_row_that_is_cut_is_named(motions):
    path = motions.csv(motions.raw())
    text = path.read_text()
    path.write_text(text[: len(text) - 100])
    with pytest.raises(BadInput, match="row 80: expected 36 columns like the rows before, came"):
        read_g1_csv(path, 30)


@pytest.mark.parametrize("first_row", [1, 2])
def test_a_cell_that_is_no_number_is_named(motions, first_row):
    header = ",".join([*"xyzabcd", *joint_names(every=True)]) if first_row == 2 else ""
    path = motions.csv(motions.raw(), header=header)
    lines = path.read_text().splitlines()
    cells = lines[10].split(",")
    cells[5] = "oops"
    lines[10] = ",".join(cells)
    path.write_text("\n".join(lines))
    with pytest.raises(BadInput, match="row 11, column 6: expected a number, came 'oops'"):
        read_g1_csv(path, 30)


@pytest.mark.parametrize("content", ["", "\n\n"])
def test_an_empty_file_is_said(tmp_path, content):
    (tmp_path / "a.csv").write_text(content)
    with pytest.raises(BadInput, match=r"a\.csv: .* came an empty file"):
        read_g1_csv(tmp_path / "a.csv", 30)


def test_bytes_that_are_no_text_are_said(tmp_path):
    (tmp_path / "a.csv").write_bytes(b"\xff\xfe\x00\x01" * 50)
    with pytest.raises(BadInput, match="bytes that are no text"):
        read_g1_csv(tmp_path / "a.csv", 30)


def test_the_frame_rate_is_a_setting_and_may_hang_on_the_folder(motions):
    raw = motions.raw(frames=61)
    config = ReadConfig(csv_fps=60, csv_fps_by_folder={"lafan1": 30})
    assert read_file(motions.csv(raw, "a/sway.csv"), config)[0].duration == pytest.approx(1.0)
    assert read_file(motions.csv(raw, "lafan1/walks/sway.csv"), config)[0].duration == pytest.approx(2.0)
