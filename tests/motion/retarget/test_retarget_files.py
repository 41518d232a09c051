"""`bumblebee motions retarget`: files that say what they hold, licences beside, bad ones one line each."""

import csv
import io
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from bumblebee.errors import BadInput
from bumblebee.motion.formats.read import RobotConfig
from bumblebee.motion.formats.read import read_robot as read_again
from bumblebee.motion.formats.write import write_motion
from bumblebee.motion.kinematics import make_clip
from bumblebee.motion.retarget.mapping import read_robot
from bumblebee.motion.retarget_files import RobotFiles, _cell, _Job, _made
from bumblebee.robot.facts import joint_names, stand_pose
from tests.commands.conftest import run as run_command
from tests.motion.human.people import bvh
from tests.motion.retarget.robots import H1
from tests.motion.retarget.stepping import steps

ROBOT = ("--model", H1 / "h1.xml", "--mapping", H1 / "h1.yaml")


run = partial(run_command, "motions", "retarget")


@pytest.fixture
def people(tmp_path):
    """Two people of one name in two folders, a broken file, and a motion that is on the G1 already."""
    folder = tmp_path / "in"
    for name in ("a/sway.bvh", "b/sway.bvh"):
        (folder / name).parent.mkdir(parents=True)
        (folder / name).write_text(bvh(60))
    (folder / "bad.bvh").write_text("HIERARCHY\nROOT")
    clip = make_clip("g1", 50.0, np.tile([0, 0, 0.79], (60, 1)), np.tile([1.0, 0, 0, 0], (60, 1)), _stand())
    write_motion(folder / "robot", clip, "asap")
    (folder / "LICENCE.txt").write_text("CC-BY-4.0")
    return folder


def _stand() -> np.ndarray:
    return np.tile(stand_pose(), (60, 1))


def test_an_npz_says_its_rate_joints_and_the_order_of_the_quaternion(people, tmp_path, capsys):
    assert run(people, "--out", tmp_path / "out", *ROBOT, "--fps", 30) == 0
    said = capsys.readouterr()
    assert "4 files: 2 motions written, 2 skipped" in said.out and "wxyz" in said.out
    assert "skipped: bad.bvh: expected" in said.err and "motions convert" in said.err and said.err.count("\n") == 2
    robot = read_robot(H1 / "h1.xml", H1 / "h1.yaml")
    with np.load(tmp_path / "out/sway.npz", allow_pickle=False) as held:
        assert held["fps"].tolist() == [30.0] and str(held["robot"]) == "h1"
        assert tuple(held["joint_names"]) == robot.tree.joints
        frames = len(held["root_pos"])
        assert held["joint_pos"].shape == (frames, 19) and held["root_quat_wxyz"].shape == (frames, 4)
        np.testing.assert_allclose(np.linalg.norm(held["root_quat_wxyz"], axis=1), 1, atol=1e-6)
        assert 0.9 < held["root_pos"][:, 2].mean() < 1.15  # an H1 that stands


def test_names_are_distinct_and_each_has_its_row_of_licences(people, tmp_path):
    assert run(people, "--out", tmp_path / "out", *ROBOT) == 0
    with (tmp_path / "out/LICENCES.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len({row["file"] for row in rows}) == 2
    assert {row["file"] for row in rows} | {"LICENCES.csv"} == {f.name for f in (tmp_path / "out").iterdir()}
    assert {row["source"] for row in rows} == {"a/sway.bvh", "b/sway.bvh"} and {row["fps"] for row in rows} == {"50"}


def test_a_csv_has_a_header_and_the_same_numbers(people, tmp_path):
    assert run(people / "a/sway.bvh", "--out", tmp_path / "csv", *ROBOT, "--to", "csv") == 0
    assert run(people / "a/sway.bvh", "--out", tmp_path / "npz", *ROBOT) == 0
    with (tmp_path / "csv/sway.csv").open() as file:
        rows = list(csv.DictReader(file))
    with np.load(tmp_path / "npz/sway.npz") as held:
        for number, name in enumerate(held["joint_names"]):
            np.testing.assert_allclose([float(r[name]) for r in rows], held["joint_pos"][:, number], atol=1e-5)
        quat = [[float(r[f"root_q{c}"]) for c in "wxyz"] for r in rows]
        np.testing.assert_allclose(quat, held["root_quat_wxyz"], atol=1e-5)
        assert [float(r["time"]) for r in rows[:3]] == [0.0, 0.02, 0.04]


def test_without_a_model_it_is_the_g1_and_convert_is_named(people, tmp_path, capsys):
    assert run(people / "a", "--out", tmp_path / "out") == 0
    assert "Onto g1_23dof; `bumblebee motions convert`" in capsys.readouterr().out
    with np.load(tmp_path / "out/sway.npz") as held:
        assert tuple(held["joint_names"]) == joint_names()


@pytest.mark.parametrize("to", ["npz", "csv"])
def test_what_it_writes_is_read_again(people, tmp_path, to):
    out = tmp_path / "out"
    assert run(people / "a", "--out", out, "--to", to) == 0
    data = (out / f"sway.{to}").read_bytes()
    (motion,) = read_again(out / f"sway.{to}", data, RobotConfig(csv_fps=50.0))
    assert motion.fps == 50.0
    if to == "npz":
        with np.load(out / "sway.npz") as held:
            np.testing.assert_array_equal(motion.joint_pos, held["joint_pos"])
            np.testing.assert_array_equal(motion.root_quat, held["root_quat_wxyz"])
        return
    rows = data.decode().splitlines(keepends=True)
    gap = "".join(rows[:5] + rows[8:]).encode()
    with pytest.raises(BadInput, match=r"row 6, time: expected 0\.08, the next, came 0\.14"):
        read_again(out / "sway.csv", gap, RobotConfig(csv_fps=50.0))


def test_results_are_replaced_only_when_asked_for_and_never_somebody_elses(people, tmp_path, capsys):
    out = tmp_path / "out"
    assert run(people / "a", "--out", out, *ROBOT) == 0
    assert run(people / "a", "--out", out, *ROBOT) == 2
    assert "Add --overwrite" in capsys.readouterr().err
    assert run(people / "a", "--out", out, *ROBOT, "--overwrite") == 0
    (out / "mine.txt").write_text("mine")
    assert run(people / "a", "--out", out, *ROBOT, "--overwrite") == 2
    assert run(people, "--out", people / "out", *ROBOT) == 2


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--model", H1 / "h1.xml"), "an MJCF and its --mapping"),
        (("--mapping", H1 / "h1.yaml"), "an MJCF and its --mapping"),
        (("--model", "none.xml", "--mapping", H1 / "h1.yaml"), "an MJCF that MuJoCo loads"),
        (("--model", H1 / "h1.xml", "--mapping", "none.yaml"), "no such file"),
        ((*ROBOT, "--to", "bvh"), "npz or csv"),
    ],
)
def test_a_robot_that_is_none_is_status_two_and_one_line_and_nothing_is_written(
    people, tmp_path, capsys, arguments, said
):
    assert run(people, "--out", tmp_path / "out", *arguments) == 2
    error = capsys.readouterr().err
    assert said in error and error.count("\n") == 1 and not (tmp_path / "out").exists()


def test_a_folder_with_no_person_is_status_two_and_leaves_nothing(people, tmp_path, capsys):
    assert run(people / "robot", "--out", tmp_path / "out", *ROBOT) == 2
    assert "a motion of a person" in capsys.readouterr().err and not (tmp_path / "out").exists()


def test_a_joints_name_with_a_comma_stays_one_column():
    assert next(csv.reader(io.StringIO(",".join(map(_cell, ["a,b", 'c"d', "e"]))))) == ["a,b", 'c"d', "e"]


def test_notes_of_the_fit_are_kept_beside_those_of_the_reader():
    person = steps(5)[0]
    rising = replace(
        person, positions=person.positions + np.linspace(0, 0.5, len(person.positions))[:, None, None] * [0, 0, 1]
    )
    made = _made(_Job("steps", motion=replace(rising, notes=("z is up",))), RobotFiles())
    assert made.job.motion.notes[0] == "z is up" and "the floor under the person moves by" in made.job.motion.notes[1]
