"""A URDF becomes a model that loads: each mending told, nothing executed or read beside it, bad input one line."""

import mujoco
import numpy as np
import pytest

from bumblebee import cli
from bumblebee.errors import BadInput
from bumblebee.measured.model_file import load_model
from bumblebee.measured.urdf import Drives, from_urdf

INERTIA = '<mass value="{mass}"/><inertia ixx="{xx}" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/>'
JOINT = (
    '<joint name="{name}" type="{kind}"><parent link="{above}"/><child link="{below}"/><origin xyz="0 0 0.3"/>'
    '<axis xyz="0 1 0"/><limit lower="{lower}" upper="1" effort="{effort}" velocity="2"/>'
    '<dynamics damping="{damping}" friction="0.1"/></joint>'
)
MESH = (
    '<visual><geometry><mesh filename="/etc/passwd"/></geometry></visual>'
    '<collision><geometry><mesh filename="x.stl"/></geometry></collision>'
)


def link(name, mass=1.0, xx=0.01, more=MESH):
    return f'<link name="{name}"><inertial>{INERTIA.format(mass=mass, xx=xx)}</inertial>{more}</link>'


def joint(name, above, below, kind="revolute", lower=-1, effort=5, damping=0.2):
    return JOINT.format(name=name, kind=kind, above=above, below=below, lower=lower, effort=effort, damping=damping)


def robot(*parts):
    return f'<?xml version="1.0"?><robot name="arm">{"".join(parts)}</robot>'


ARM = robot(
    '<link name="base"/>', link("upper"), link("lower", xx=0.0), link("grip", xx=0.1), '<link name="tool"/>',
    joint("hip", "base", "upper"), joint("knee", "upper", "lower", effort=0), joint("claw", "lower", "grip"),
    joint("end", "grip", "tool", kind="fixed"), "<gazebo><plugin filename='evil.so'/></gazebo>",
)  # fmt: skip


@pytest.fixture
def urdf(tmp_path):
    path = tmp_path / "arm.urdf"
    path.write_text(ARM)
    return path


def run(*arguments):
    return cli.run(["model", "from-urdf", *map(str, arguments)])


def test_logged_joints_move_with_a_drive_each_and_all_else_is_held_still(urdf, tmp_path, capsys):
    out = tmp_path / "model.xml"
    assert run(urdf, "--joints", "hip,knee", "--drive", "torque", "--out", out) == 0
    model = load_model(out)
    assert [model.joint(j).name for j in range(model.njnt)] == ["hip", "knee"]
    assert [model.actuator(a).name for a in range(model.nu)] == ["hip", "knee"]
    assert model.actuator_forcerange[0].tolist() == [-5, 5] and not model.actuator_forcelimited[1]
    assert np.isclose(model.body_mass.sum(), 3.0) and model.nmesh == 0
    said = capsys.readouterr().out
    assert "held still at 0: claw" in said and "link lower: inertia" in said and "no effort limit in the URDF" in said
    assert "evil" not in out.read_text() and "passwd" not in out.read_text()


def test_gains_of_position_drives_are_those_that_were_declared(urdf):
    made = from_urdf(urdf, ("hip", "knee"), Drives("position", {"": 40.0, "knee": 25.0}, {"": 1.0}))
    model = mujoco.MjModel.from_xml_string(made.xml)
    assert model.actuator_gainprm[:, 0].tolist() == [40, 25]
    assert model.actuator_biasprm[:, 2].tolist() == [-1, -1]


def test_an_unphysical_inertia_keeps_its_largest_part_and_a_sound_one_is_untouched(urdf):
    model = mujoco.MjModel.from_xml_string(from_urdf(urdf, ("hip", "knee", "claw"), Drives()).xml)
    assert np.allclose(np.sort(model.body("grip").inertia), [0.05, 0.05, 0.1], rtol=1e-3)
    assert np.allclose(model.body("upper").inertia, 0.01)


def test_what_moves_without_mass_gets_a_small_one_and_shapes_weigh_nothing(tmp_path):
    ball = '<collision><geometry><sphere radius="0.1"/></geometry></collision>'
    (tmp_path / "a.urdf").write_text(
        robot('<link name="base"/>', f'<link name="hand">{ball}</link>', joint("hip", "base", "hand"))
    )
    made = from_urdf(tmp_path / "a.urdf", ("hip",), Drives())
    model = mujoco.MjModel.from_xml_string(made.xml)
    assert np.isclose(model.body("hand").mass[0], 1e-3) and model.ngeom == 1
    assert "link hand: moves and has no mass: 0.001 kg" in made.notes


@pytest.mark.parametrize(
    ("broken", "said"),
    [
        (joint("hip", "base", "upper", lower=1), "range 1 to 1 left out"),
        (joint("hip", "base", "upper", damping=-1), "damping -1 is negative"),
    ],
)
def test_ranges_and_damping_that_mean_nothing_are_left_out_with_a_note(broken, said, tmp_path):
    (tmp_path / "a.urdf").write_text(robot('<link name="base"/>', link("upper"), broken))
    made = from_urdf(tmp_path / "a.urdf", ("hip",), Drives())
    assert any(said in note for note in made.notes)


WRONG = {
    "names near": (ARM, "hipp", "Near names: hip."),
    "fixed": (ARM, "end", "a fixed joint"),
    "mjcf": ("<mujoco/>", "hip", "give it to --model"),
    "no xml": ("ply 1.0", "hip", "which is XML"),
    "entities": ('<!DOCTYPE r [<!ENTITY x SYSTEM "/etc/passwd">]><robot name="r">&x;</robot>', "hip", "<!DOCTYPE"),
    "xacro": (
        '<robot xmlns:xacro="http://ros.org/xacro"><xacro:include filename="b"/></robot>', "hip", "xacro a.urdf >",
    ),
    "loop": (robot(link("a"), link("b"), joint("hip", "a", "b"), joint("knee", "b", "a")), "hip", "hang in a loop"),
    "two roots": (robot(link("a"), link("b")), "hip", "2: a, b"),
    "no link": (robot(link("a"), joint("hip", "a", "b")), "hip", "links of the file"),
    "no number": (ARM.replace('mass value="1.0"', 'mass value="nan"'), "hip", "finite numbers"),
    "no axis": (ARM.replace("0 1 0", "0 0 0"), "hip", "a direction"),
    "short": (ARM.replace('xyz="0 1 0"', 'xyz="0 1"'), "hip", "a URDF that MuJoCo loads"),
}  # fmt: skip


@pytest.mark.parametrize("case", WRONG)
def test_bad_input_is_one_line_and_nothing_is_written(case, tmp_path, capsys, monkeypatch):
    text, name, said = WRONG[case]
    (tmp_path / "a.urdf").write_text(text)
    monkeypatch.setattr("sys.argv", ["bumblebee", "model", "from-urdf", str(tmp_path / "a.urdf"), "--joints", name,
                                     "--drive", "torque", "--out", str(tmp_path / "m.xml")])  # fmt: skip
    with pytest.raises(SystemExit) as end:
        cli.main()
    line = capsys.readouterr().err
    assert end.value.code == 2 and line.count("\n") == 1 and said in line
    assert [path.name for path in tmp_path.iterdir()] == ["a.urdf"]


def test_gains_that_are_missing_are_asked_for(urdf):
    with pytest.raises(
        BadInput, match=r"--kv: expected a gain of every position drive, came none of hip, knee.*--kv VALUE"
    ):
        from_urdf(urdf, ("hip", "knee"), Drives("position", {"": 40.0}))
    with pytest.raises(BadInput, match="no such file"):
        from_urdf(urdf.with_name("none.urdf"), ("hip",), Drives())
