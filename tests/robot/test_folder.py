"""A robot's folder becomes one table, whatever it is written as; what does not fit is one line."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml

from bumblebee.errors import BadInput
from bumblebee.new_robot.first_folder import draft_folder
from bumblebee.robot.folder import read_folder
from bumblebee.robot.mjcf import bodies_of
from bumblebee.robot.which import VARIABLE, path_of, shipped
from tests.robot.made_up import mjcf


def folder(tmp_path: Path, **changed: object) -> Path:
    """The made-up robot's drafted file, some keys changed; None takes a key away."""
    (tmp_path / "made.xml").write_text(mjcf())
    draft_folder(tmp_path / "made.xml", tmp_path / "robot")
    file = tmp_path / "robot" / "robot.yaml"
    said = {**yaml.safe_load(file.read_text()), **changed}
    file.write_text(yaml.safe_dump({key: value for key, value in said.items() if value is not None}))
    return file


def joints_of(robot) -> list[str]:
    names = [facts["joint"]["name"] for facts in robot.bodies.values() if "joint" in facts]
    return [name for name in names if name not in robot.written.held]


def test_those_that_come_along() -> None:
    found = {name: len(joints_of(read_folder(path_of(name)))) for name in shipped()}
    assert found == {"g1_23": 23, "g1_29": 29, "g1_unitree_23": 23, "h1": 19}


def test_robots_differ_in_their_hash_and_comments_do_not_matter(tmp_path: Path) -> None:
    hashes = {read_folder(path_of(name)).sha256 for name in shipped()}
    assert len(hashes) == len(shipped())
    like = tmp_path / "robot.yaml"
    like.write_text("# ours\nlike: g1_23\n")
    assert read_folder(like).sha256 == read_folder(path_of("g1_23")).sha256


def test_a_hand_that_is_a_point_becomes_a_body_without_mass(tmp_path: Path) -> None:
    robot = read_folder(folder(tmp_path))
    hand = robot.bodies["left_hand"]
    assert (hand["parent"], hand["mass"]) == ("l_lower", 0.0)
    assert hand["pos"] == pytest.approx([0, 0, -0.216])


def test_motors_are_said_for_every_joint_and_by_joint(tmp_path: Path) -> None:
    robot = read_folder(folder(tmp_path, motors={"every": {"velocity_limit": 12.0}, "l_bend": {"kp": 90.0, "kd": 3.0}}))
    by_name = {facts["joint"]["name"]: facts["joint"] for facts in robot.bodies.values() if "joint" in facts}
    assert {joint["velocity_limit"] for joint in by_name.values()} == {12.0}
    assert (by_name["l_bend"]["kp"], "kp" in by_name["r_bend"]) == (90.0, False)
    assert by_name["l_bend"]["effort_limit"] == 120.0  # as the model's motor says


def test_a_box_becomes_the_capsule_along_its_longest_side_and_a_link_of_a_mesh_one_of_its_inertia(
    tmp_path: Path,
) -> None:
    skull, cap = '<body name="skull" pos="0 0 0.48">', '<geom type="mesh" mesh="cap" material="felt"/>'
    assets = '<asset><mesh name="cap" file="not_here.stl"/><material name="felt"/></asset>'
    text = mjcf(**{skull: skull + cap, "<worldbody>": assets + "<worldbody>"})
    (tmp_path / "made.xml").write_text(text.replace('<geom type="sphere"', '<geom material="felt" type="sphere"'))
    bodies = bodies_of(tmp_path / "made.xml")
    (shoe,) = bodies["l_shoe"]["collision"]
    assert shoe["type"] == "capsule"
    assert 2 * (shoe["size"][0] + shoe["size"][1]) == pytest.approx(0.22)
    (skull,) = bodies["skull"]["collision"]
    assert skull["size"][0] == pytest.approx(0.08 * np.sqrt(1.5), rel=1e-3)  # even: the box of three like moments
    assert "collision" not in bodies["l_joint"]  # whose maker gives it nothing that touches


@pytest.mark.parametrize(
    ("changed", "line"),
    [
        ({"soles": None}, "expected .*, came no soles"),
        ({"colour": "red"}, "came unknown 'colour'"),
        ({"bodies": "x.yaml"}, "`model`, the maker's MJCF, or `bodies`.*came both or neither"),
        ({"model": "../made.xml"}, "expected the name of a file beside it"),
        ({"held": ["tail"]}, "held: expected joints of the model: l_yaw.*, came tail"),
        ({"stand": {"l_bendd": 0.3}}, "stand: expected joints of the model: l_yaw.*, came l_bendd"),
        ({"head": ["hat", [0, 0, 0]]}, "head: expected a body of the model: hips.*, came hat"),
        (
            {"motors": {"every": {"velocity_limit": 9.0, "kp": 50.0}}},
            "l_yaw: expected kp and kd of a servo",
        ),
        ({"motors": {"every": {"velocity_limit": 0}}}, r"motors\.every\.velocity_limit: expected a number from 1e-06"),
        ({"motors": {"l_bend": {"power": 3}}}, r"motors\.l_bend: expected kp, .*, came unknown 'power'"),
        ({"motors": {}}, "its velocity_limit, came neither in the model nor in `motors`"),
        ({"sole_radius": "1 cm"}, "sole_radius: expected a number from 0.0001 to 0.1 m"),
        ({"soles": {"left": [[0, 0, 0]], "right": []}}, r"soles\.left: expected 4 corners"),
        ({"key_bodies": {"pelvis": "hips"}}, "key_bodies: expected pelvis, left_hip, .*, came no left_hip"),
        ({"robot": ""}, "robot: expected a name"),
        ({"like": "atlas"}, "like: expected one of g1_23, g1_29, g1_unitree_23, h1, came 'atlas'"),
    ],
)
def test_a_file_that_does_not_fit_is_one_line(tmp_path: Path, changed: dict, line: str) -> None:
    with pytest.raises(BadInput, match=line):
        read_folder(folder(tmp_path, **changed))


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        ("pelvis: hips", "pelvis: chest", r"key_bodies\.pelvis: expected hips, the body that floats, came chest"),
        ("left_knee: l_shin", "left_knee: shin", r"key_bodies\.left_knee: expected a body of the model.*, came shin"),
        ("torso: chest", "torso: hips", r"14 places, each named once, came hips twice\. Write one .*\[hips, \[0\.0"),
    ],
)
def test_a_role_that_the_model_cannot_play(tmp_path: Path, old: str, new: str, line: str) -> None:
    file = folder(tmp_path)
    assert old in file.read_text()
    file.write_text(file.read_text().replace(old, new))
    with pytest.raises(BadInput, match=line):
        read_folder(file)


def test_a_point_has_no_name_that_a_body_has(tmp_path: Path) -> None:
    (tmp_path / "made.xml").write_text(mjcf().replace('"l_cross"', '"left_hand"'))
    draft_folder(tmp_path / "made.xml", tmp_path / "robot")
    with pytest.raises(BadInput, match=r"key_bodies\.left_hand: expected the model's own body left_hand, came a point"):
        read_folder(tmp_path / "robot" / "robot.yaml")


def test_a_gear_counts_in_torque_and_gains(tmp_path: Path) -> None:
    servo = '<position joint="nod" kp="3" kv="0.5" gear="10" forcerange="-2 2"/>'
    (tmp_path / "made.xml").write_text(mjcf().replace('<motor joint="nod" ctrlrange="-10 10"/>', servo))
    nod = bodies_of(tmp_path / "made.xml")["skull"]["joint"]
    assert (nod["effort_limit"], nod["kp"], nod["kd"]) == pytest.approx((20.0, 300.0, 50.0))


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        ("<actuator>", '<tendon><fixed><joint joint="nod" coef="1"/></fixed></tendon><actuator>', "and 1 tendons"),
        ('<body name="skull"', "<body", "a body of chest: expected a name, came none"),
        ('name="nod" axis', 'name="nod" stiffness="3" axis', "nod: expected a joint without a spring"),
        ('<motor joint="nod"', '<motor joint="nod"/><motor joint="nod"', "nod: expected one drive, came 2"),
        ("<worldbody>", '<include file="legs.xml"/><worldbody>', "a model in one file, came an `include`"),
        ("<worldbody>", '<worldbody><replicate count="999999"><geom size="1"/></replicate>', "a replicate of at most"),
        ("<freejoint/>", "", "expected a base with a `freejoint`, came a model without one"),
        (
            '<joint name="spin" axis="0 0 1" range="-1.5 1.5"/>',
            '<joint name="spin" type="ball"/>',
            "chest: expected one hinge",
        ),
        (
            '<joint name="nod"',
            '<joint name="n2" range="0 1"/><joint name="nod"',
            "skull: expected one hinge a body, came 2",
        ),
        ('name="nod" axis="0 1 0" range="-0.5 0.5"', 'name="nod" axis="0 1 0"', "nod: expected a range, came none"),
        ('name="nod" axis', 'name="nod" pos="0 0 0.1" axis', "nod: expected a joint at its body's origin"),
        ("<actuator>", '<equality><weld body1="skull" body2="chest"/></equality><actuator>', "came 1 equalities"),
        ("<mujoco", "<robot", "expected an MJCF model, came another file"),
        ("</worldbody>", "", "expected an MJCF that loads without its meshes"),
    ],
)
def test_a_model_that_the_table_cannot_hold_is_one_line(tmp_path: Path, old: str, new: str, line: str) -> None:
    (tmp_path / "made.xml").write_text(mjcf().replace(old, new))
    with pytest.raises(BadInput, match=line):
        bodies_of(tmp_path / "made.xml")


def test_meshes_need_not_be_there_but_masses_must(tmp_path: Path) -> None:
    meshes = '<asset><mesh name="m" file="nowhere.stl"/></asset><worldbody>'
    text = mjcf().replace("<worldbody>", meshes)
    with_mesh = text.replace('<geom type="sphere" size="0.09"/>', '<geom type="mesh" mesh="m"/>')
    (tmp_path / "made.xml").write_text(with_mesh)
    assert bodies_of(tmp_path / "made.xml")["hips"]["mass"] == 6.0
    start = with_mesh.index("<inertial")
    (tmp_path / "made.xml").write_text(with_mesh[:start] + with_mesh[with_mesh.index("/>", start) + 2 :])
    with pytest.raises(BadInput, match=r"loads without its meshes.*must be written in the model"):
        bodies_of(tmp_path / "made.xml")


def test_no_such_robot() -> None:
    with pytest.raises(BadInput, match=r"robot nobody: expected a folder with a robot\.yaml, or one of g1_23"):
        path_of("nobody")


def test_motions_that_come_along_are_for_our_g1_alone() -> None:
    command = [sys.executable, "-c", "import bumblebee as bb; bb.read_motions()"]
    came = subprocess.run(command, env=os.environ | {VARIABLE: "h1"}, capture_output=True, text=True, timeout=120)
    assert "expected a folder of motion files, came those that come along for g1_23dof, and this is h1" in came.stderr
