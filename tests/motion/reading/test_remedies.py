"""Every remedy that a motions command prints is carried out as it is printed, and the file is read after it."""

import io
import re
import tarfile
import zipfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import joblib
import numpy as np
import pytest

from bumblebee.motion.formats.write import write_motion
from bumblebee.robot.facts import joint_names
from tests.commands.test_cli_motions import run
from tests.motion.conftest import Motions, standing
from tests.motion.human.people import bvh, npz, rows, smpl

POINTER = b"version https://git-lfs.github.com/spec/v1\noid sha256:" + b"0" * 64 + b"\nsize 12345\n"


def still(motions: Motions):
    """A robot that stands and does not move: nothing tells the order of its quaternion."""
    raw = motions.raw()
    quat, joints = np.tile([1.0, 0, 0, 0], (80, 1)), np.tile(raw.joint_pos[0], (80, 1))
    return replace(raw, root_quat=quat, joint_pos=joints, root_pos=standing(quat, joints))


def saved(path: Path, **arrays: object) -> Path:
    path.write_bytes(npz(arrays))
    return path


def euler(motions: Motions, metres: float, degrees: float, names: str = "x y z rx ry rz") -> Path:
    """A CSV file with Euler angles in units that its names do not say."""
    raw = motions.raw(yaw=0.0)
    angles = np.zeros((80, 3))
    angles[:, 2] = 2 * np.arcsin(raw.root_quat[:, 3])
    table = np.concatenate([raw.root_pos * metres, angles * degrees, raw.joint_pos * degrees], axis=1)
    path = motions.folder / "euler.csv"
    np.savetxt(path, table, delimiter=",", header=",".join([*names.split(), *joint_names()]), comments="")
    return path


def qpos(motions: Motions, joints: np.ndarray) -> Path:
    """An `.npz` file with the root before the joints, and nothing that tells their order."""
    raw = motions.raw()
    return saved(motions.folder / "a.npz", fps=30, joint_pos=np.c_[raw.root_pos, raw.root_quat, joints])


SOMA = "root_translateX root_translateY root_translateZ root_rotateX root_rotateY root_rotateZ"
LYING = rows(40)
LYING[:, 1], LYING[:, 5] = 10, 90
Y_UP = {"poses": np.zeros((40, 72)), "trans": np.tile([0.0, 1.15, 0.0], (40, 1)), "mocap_framerate": np.array(30.0)}


Y_DOWN = np.tile([np.pi, *[0.0] * 71], (40, 1))


def text(motions: Motions, content: str) -> Path:
    path = motions.folder / "a.bvh"
    path.write_text(content)
    return path


ASKED: dict[str, tuple[Callable[[Motions], Path], tuple[str, ...]]] = {
    "the rate of a CSV": (lambda m: m.csv(m.raw()), ()),
    "the rate of SMPL": (lambda m: saved(m.folder / "a.npz", **smpl(mocap_framerate=None)), ()),
    "the units of Euler angles": (lambda m: euler(m, 100, 180 / np.pi), ("--csv-fps", "30")),
    "metres in SOMA's layout": (lambda m: euler(m, 1, 180 / np.pi, SOMA), ("--csv-fps", "30")),
    "radians in SOMA's layout": (lambda m: euler(m, 100, 1, SOMA), ("--csv-fps", "30")),
    "the order of a quaternion": (lambda m: m.csv(still(m)), ("--csv-fps", "30")),
    "which of root_rot and pose_aa": (lambda m: m.pickle(m.raw(), root_rot=m.raw(yaw=1.9).root_quat), ()),
    "the layout of 23 joints in a CSV": (lambda m: m.csv(m.raw(), dof=23), ("--csv-fps", "30")),
    "the layout of 23 joints in a pickle": (lambda m: m.pickle(m.raw(), pose_aa=None), ()),
    "the order of joints in an npz": (lambda m: qpos(m, np.zeros((80, 29))), ()),
    "order and layout of 23 joints in an npz": (lambda m: qpos(m, m.raw().joint_pos), ()),
    "the unit of a BVH": (lambda m: text(m, bvh(scale=60)), ()),
    "a unit that cannot be": (lambda m: text(m, bvh(scale=60)), ("--set", "unit=m")),
    "the up axis of a BVH": (lambda m: text(m, bvh(values=LYING)), ()),
    "the up axis of SMPL, y up": (lambda m: saved(m.folder / "a.npz", **Y_UP), ()),
    "the up axis of SMPL, y down": (
        lambda m: saved(m.folder / "a.npz", **{**Y_UP, "poses": np.tile([np.pi, *[0] * 71], (40, 1))}),
        (),
    ),
}


def choices(said: str) -> list[list[str]]:
    """The options that a message offers, one list for each answer."""
    offered = re.search(r"Say it: (.*?) \(for the loop, in params\.yaml: ([\w., ]+)\)\.", said)
    assert offered, said
    keys = set(re.findall(r"--set (\w+)=", offered[1].replace("--csv-fps ", "--set csv_fps=")))
    assert set(offered[2].split(", ")) == {f"motions.read.{key}" for key in keys}
    return [answer.split() for answer in offered[1].split(" or ")]


@pytest.mark.parametrize("what", ASKED)
def test_a_setting_that_is_asked_for_works_as_printed(motions, capsys, what):
    make, given = ASKED[what]
    path = make(motions)
    assert run("inspect", path, *given) == 2
    said = capsys.readouterr()
    assert said.err.count("\n") == 1
    answers = choices(said.err)
    results = [run("inspect", path, *given, *answer) for answer in answers]
    assert results == [0] * len(answers), capsys.readouterr().err


@pytest.mark.parametrize("what", ["the rate of SMPL", "the up axis of SMPL, y down"])
def test_the_commands_that_write_ask_alike_and_take_the_same_settings(motions, tmp_path, capsys, what):
    path = ASKED[what][0](motions)
    for command in (("retarget",), ("convert", "--to", "asap")):
        out = tmp_path / command[0]
        assert run(command[0], path, "--out", out, *command[1:]) == 2 and not out.exists()
        assert run(command[0], path, "--out", out, *command[1:], *choices(capsys.readouterr().err)[0]) == 0


AIST = {"smpl_poses": smpl()["poses"], "smpl_trans": 90 * np.asarray(smpl()["trans"]), "smpl_scaling": np.array([90.0])}
OMOMO = {"seq_name": "sub1_box", "root_orient": np.asarray(smpl()["poses"])[:, :3],
         "pose_body": np.asarray(smpl()["poses"])[:, 3:66], "trans": smpl()["trans"], "betas": np.zeros((1, 16)),
         "gender": "male", "obj_rot": np.zeros((40, 3, 3))}  # fmt: skip


def pickled(path: Path, content: object) -> Path:
    joblib.dump(content, path)
    return path


def loco(m: Motions) -> dict[str, object]:
    raw = m.raw()
    return {"qpos": np.c_[raw.root_pos, raw.root_quat, raw.joint_pos], "qvel": np.zeros((80, 29)), "frequency": 30.0,
            "split_points": np.array([0, 80]), "joint_names": np.array(["root", *joint_names()])}  # fmt: skip


@pytest.mark.parametrize(
    ("make", "kind"),
    [
        (lambda m: (pickled(m.folder / "d.pkl", AIST), AIST), "a dance of AIST++"),
        (lambda m: (pickled(m.folder / "d.p", {0: OMOMO}), OMOMO), "people of OMOMO"),
        (lambda m: (saved(m.folder / "d.npz", **loco(m)), loco(m)), "a trajectory of loco-mujoco"),
    ],
)
def test_a_known_set_that_is_not_read_says_what_it_is_and_how_to_save_it(motions, tmp_path, capsys, make, kind):
    path, fields = make(motions)
    assert run("inspect", path) == 2
    said = capsys.readouterr().err
    assert f"came {kind}" in said and said.count("\n") == 1
    named = dict(re.findall(r"(\w+)=([\w/]+)", said.partition(".npz with ")[2].partition("(for the loop")[0]))
    options = ["--set", f"up={named.pop('up')}"] if "up" in named else []
    arrays = {name: eval(expression, {}, dict(fields)) for name, expression in named.items()}
    assert run("inspect", saved(tmp_path / "saved.npz", **arrays), *options) == 0


@pytest.mark.parametrize(
    ("name", "content", "line"),
    [
        ("a.npy", np.zeros((40, 263)), "HumanML3D's features, which are no poses. Read the file that it was made from"),
        ("a.npy", np.zeros((40, 22, 3)), "HumanML3D's joints without rotations"),
        ("a.npy", np.zeros((40, 36)), r"one NumPy array of shape \(40, 36\), which does not say what it holds"),
        (
            "a.motion",
            None,
            r"a motion of ProtoMotions \(torch\)\. Load it with torch and save it as \.npz with joint_pos=",
        ),
        ("a.pt", None, "a torch file, which may call anything. Load it with torch"),
        ("a.fbx", None, "an FBX file. Export it as BVH"),
    ],
)
def test_other_formats_of_the_field_are_named(tmp_path, capsys, name, content, line):
    stream = io.BytesIO(b"PK")
    if content is not None:
        np.save(stream, content)
    (tmp_path / name).write_bytes(stream.getvalue())
    assert run("inspect", tmp_path / name) == 2
    assert re.search(f"came {line}", capsys.readouterr().err)


def test_a_pointer_of_git_lfs_is_named_whatever_its_suffix_and_wherever_it_lies(motions, tmp_path, capsys):
    folder = tmp_path / "in"
    folder.mkdir()
    for name in ("a.npz", "b.pkl", "c.csv", "d.bvh", "e.zip", "f.tar.gz", "g.npy"):
        (folder / name).write_bytes(POINTER)
    with zipfile.ZipFile(folder / "h.zip", "w") as archive:
        archive.writestr("inside.pkl", POINTER)
    with tarfile.open(folder / "i.tar", "w") as archive:
        info = tarfile.TarInfo("inside.npz")
        info.size = len(POINTER)
        archive.addfile(info, io.BytesIO(POINTER))
    whole = motions.pickle(motions.raw(), "in/walk.pkl")
    (folder / "walk.txt").write_bytes(POINTER)
    assert run("inspect", folder, "--csv-fps", "30") == 0
    said = " ".join(capsys.readouterr().out.split())
    assert said.count("a Git LFS pointer") == 10 and said.count("`git lfs pull`") == 10
    (folder / "b.pkl").write_bytes(whole.read_bytes())  # what the command does
    (folder / "walk.txt").write_text("a person sways.#a/DET#0.0#0.0")
    assert run("inspect", folder, "--csv-fps", "30") == 0
    assert capsys.readouterr().out.count("a Git LFS pointer") == 8


def test_notes_of_inspect_are_printed_by_every_command(motions, tmp_path, capsys):
    turned = motions.raw(yaw=np.pi)
    motions.csv(turned, "in/robot.csv", order="wxyz")
    (motions.folder / "in/person.bvh").write_text(bvh(60))
    path, csv = motions.folder / "in", ("--csv-fps", 30)
    robot, person = "root quaternions wxyz: the foot that stands", "y is up, by the motion"
    for command, notes in (
        (("inspect", path, *csv), (robot, person)),
        (("convert", path, "--to", "asap", "--out", tmp_path / "asap", *csv), (robot, person)),
        (("retarget", path, "--out", tmp_path / "g1", *csv), (person,)),
        (("play", path, "--motion", "robot", "--out", tmp_path / "a.gif", *csv), (robot,)),
    ):
        assert run(*command) == 0
        said = " ".join(capsys.readouterr().out.split())
        assert all(note in said for note in notes), command


def test_what_is_in_the_way_is_replaced_with_the_option_that_is_printed(motions, tmp_path, capsys):
    write_motion(motions.folder / "in", motions.clip(), "asap")
    convert = ("convert", motions.folder / "in", "--to", "g1_csv", "--out", tmp_path / "out")
    assert run(*convert) == 0 and run(*convert) == 2
    assert "Add --overwrite" in capsys.readouterr().err and run(*convert, "--overwrite") == 0


def test_several_motions_are_one_with_the_name_that_is_printed(motions, tmp_path, capsys):
    for name in ("a", "b"):
        write_motion(motions.folder / "in", motions.clip(name), "asap")
    play = ("play", motions.folder / "in", "--out", tmp_path / "a.gif")
    assert run(*play) == 2
    name = re.search(r"--motion: (\w+),", capsys.readouterr().err)[1]
    assert run(*play, "--motion", name) == 0


def test_files_that_hold_no_rate_are_written_at_the_one_that_is_printed(motions, tmp_path, capsys):
    for name, fps in (("a", 30.0), ("b", 60.0)):
        write_motion(motions.folder / "in", replace(motions.clip(name), fps=fps), "asap")
    convert = ("convert", motions.folder / "in", "--to", "g1_csv", "--out", tmp_path / "out")
    assert run(*convert) == 2
    rate = re.search(r"Say it: --fps (\d+)\.", capsys.readouterr().err)[1]
    assert run(*convert, "--fps", rate) == 0
