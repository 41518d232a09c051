"""mjlab's and Isaac's `.npz` files: the order of joints and bodies is told by kinematics, or asked for."""

import io
import zipfile
from functools import cache

import mujoco
import numpy as np
import pytest

from bumblebee.errors import BadInput
from bumblebee.motion.formats import orders
from bumblebee.motion.formats.read import RobotConfig, is_robot_npz, read_robot
from bumblebee.motion.reading.usable import usable
from bumblebee.robot.facts import KEY_BODIES, joint_names, robot_bodies
from bumblebee.robot.model import RobotConfig as ModelConfig
from bumblebee.robot.model import build_model

NAME = "isaac.npz"


DEPTH = tuple(robot_bodies())
model_29 = cache(lambda: build_model(ModelConfig(every_joint=True)))


def arrays(raw, joints="depth_first", bodies=DEPTH, quaternion="wxyz", dof=29):
    """A file as a simulator logs it, its kinematics by MuJoCo with 29 joints that all move."""
    model = model_29()
    data = mujoco.MjData(model)
    wide = 0.3 * np.sin(np.arange(len(raw.root_pos)))[:, None] * np.ones(29)
    wide[:, [joint_names(every=True).index(name) for name in joint_names()]] = raw.joint_pos
    pos, quat = np.empty((len(wide), len(bodies), 3)), np.empty((len(wide), len(bodies), 4))
    for row, angles in enumerate(wide):
        data.qpos[:] = np.concatenate([raw.root_pos[row], raw.root_quat[row], angles])
        mujoco.mj_kinematics(model, data)
        for column, name in enumerate(bodies):
            pos[row, column], quat[row, column] = data.body(name).xpos, data.body(name).xquat
    order = orders.joint_order(joints, joint_names(every=dof == 29))
    quat = quat[..., ["wxyz".index(part) for part in quaternion]]
    return {
        "fps": np.array([50]),
        "joint_pos": wide[:, [joint_names(every=True).index(name) for name in order]].astype(np.float32),
        "body_pos_w": pos.astype(np.float32),
        "body_quat_w": quat.astype(np.float32),
    }


def npz(content):
    stream = io.BytesIO()
    np.savez(stream, **content)
    return stream.getvalue()


def read(motions, content, options=None):
    (came,) = read_robot(motions.folder / NAME, npz(content), options)
    return came


def same(came, raw):
    for name in ("root_pos", "joint_pos"):
        np.testing.assert_allclose(getattr(came, name), getattr(raw, name), atol=1e-6)
    np.testing.assert_allclose(np.abs((came.root_quat * raw.root_quat).sum(axis=1)), 1, atol=1e-6)


def test_isaacs_order_is_the_one_that_the_field_publishes():
    place = [
        joint_names(every=True).index(name) for name in orders.joint_order("breadth_first", joint_names(every=True))
    ]
    assert place == [0, 6, 12, 1, 7, 13, 2, 8, 14, 3, 9, 15, 22, 4, 10, 16, 23, 5, 11, 17, 24, 18, 25, 19, 26, 20, 27,
                     21, 28]  # fmt: skip


@pytest.mark.parametrize("joints", ["depth_first", "breadth_first"])
@pytest.mark.parametrize("bodies", [DEPTH, orders.breadth_first(), ("world", *DEPTH), KEY_BODIES])
@pytest.mark.parametrize("dof", [29, 23])
def test_the_order_of_joints_and_bodies_is_told_by_kinematics(motions, joints, bodies, dof):
    raw = motions.raw(30, fps=50.0)
    came = read(motions, arrays(raw, joints, bodies, dof=dof))
    same(came, raw)
    assert came.fps == 50 and came.name == "isaac" and joints.replace("_", "-") in came.notes[0]


def test_quaternions_of_the_other_order_are_told_too(motions):
    raw = motions.raw(30)
    came = read(motions, arrays(raw, quaternion="xyzw"))
    same(came, raw)
    assert "quaternions xyzw" in came.notes[0]


def test_a_robot_that_stands_at_zero_does_not_tell_and_the_order_is_asked_for(motions):
    raw = motions.raw(30)
    joint_pos = np.zeros_like(raw.joint_pos)
    joint_pos[:, joint_names().index("waist_yaw_joint")] = 1e-3  # too little for any body to move a millimetre
    content = arrays(motions.raw(30, joint_pos=joint_pos))
    content["joint_pos"][:, [joint_names(every=True).index(n) for n in joint_names(every=True) if "wrist" in n]] = 0
    with pytest.raises(BadInput, match=r"joint_pos: expected one order of the joints, came two that fit .*npz_joints"):
        read(motions, content)
    came = read(motions, content, RobotConfig(npz_joints="depth_first"))
    np.testing.assert_allclose(came.joint_pos, joint_pos, atol=1e-6)


def test_a_wrong_order_that_is_set_is_refused(motions):
    with pytest.raises(BadInput, match=r"body_pos_w: expected G1 bodies in a known order .* beside in the mean"):
        read(motions, arrays(motions.raw(30)), RobotConfig(npz_joints="breadth_first"))


def test_the_root_may_stand_before_the_joints(motions):
    raw = motions.raw(30)
    content = arrays(raw)
    root = np.concatenate([raw.root_pos, raw.root_quat], axis=1)
    content["joint_pos"] = np.concatenate([root, content["joint_pos"]], axis=1)
    same(read(motions, content), raw)
    alone = {key: content[key] for key in ("fps", "joint_pos")}
    with pytest.raises(BadInput, match=r"expected the order of the joints, came no bodies that would tell it\. Say it"):
        read(motions, alone)
    same(read(motions, alone, RobotConfig(npz_joints="depth_first")), raw)


def test_names_in_the_file_decide(motions):
    raw = motions.raw(30)
    names = orders.joint_order("breadth_first", joint_names(every=True))
    content = {**arrays(raw, "breadth_first"), "joint_names": np.array([f"robot/{name}" for name in names])}
    same(read(motions, content), raw)
    for wrong, line in (
        ([*names[:-1], names[1]], f"joint_names: expected each joint once, came {names[1]} in names 2 and 29"),
        ([*names[:-1], "left_tail_joint"], "joint_names, name 29: expected the name of a joint of g1_23dof"),
        (names[:-1], "joint_names: expected the names of 29 joints of g1_23dof, came 28"),
    ):
        with pytest.raises(BadInput, match=line):
            read(motions, {**content, "joint_names": np.array(wrong)})


def test_other_bodies_are_read_when_the_order_is_set_and_refused_when_not(motions):
    raw = motions.raw(30)
    content = arrays(raw, bodies=DEPTH[:5])
    with pytest.raises(BadInput, match=r"body_pos_w: expected G1 bodies in a known order .*, came 5 bodies"):
        read(motions, content)
    same(read(motions, content, RobotConfig(npz_joints="depth_first")), raw)


def test_another_robot_is_refused(motions):
    content = arrays(motions.raw(30))
    content["body_pos_w"] *= 1.3
    with pytest.raises(BadInput, match=r"came joints that put them 0\.\d\d m beside .*\. A motion of another robot\?"):
        read(motions, content)


@pytest.mark.parametrize(
    ("change", "line"),
    [
        ({"fps": None}, "fps: expected one number of frames a second .*, came none"),
        ({"fps": np.array([50, 50])}, r"fps: expected one number .* came shape \(2,\)"),
        ({"fps": np.array("fifty")}, "fps: expected one number"),
        ({"fps": np.array(0.0)}, "fps: expected one number of frames a second from 1 to 1000, came 0"),
        ({"joint_pos": np.zeros((30, 28))}, r"joint_pos: expected shape \(T, 29\) .* came \(30, 28\)"),
        ({"joint_pos": np.zeros((0, 29))}, r"joint_pos: expected shape .* came \(0, 29\)"),
        ({"joint_pos": np.zeros(29)}, r"joint_pos: expected shape .* came \(29,\)"),
        ({"joint_pos": np.zeros((30, 29), complex)}, "joint_pos: expected real numbers, came complex numbers"),
        ({"body_pos_w": None}, "expected body_pos_w .* came only body_quat_w, fps, joint_pos"),
        ({"body_pos_w": np.zeros((29, 30, 3))}, r"body_pos_w: expected shape \(30, B, 3\), came \(29, 30, 3\)"),
        ({"body_quat_w": np.zeros((30, 31, 4))}, "as many bodies in body_pos_w and body_quat_w, came 30 and 31"),
        ({"body_quat_w": np.zeros((30, 30, 4))}, "body_pos_w: expected G1 bodies .* came no finite numbers"),
        ({"body_pos_w": np.full((30, 30, 3), np.nan)}, "body_pos_w: expected G1 bodies .* came no finite numbers"),
        ({"joint_pos": np.full((30, 29), 1e300)}, "body_pos_w: expected G1 bodies in a known order"),
    ],
)
@pytest.mark.filterwarnings("error")
def test_what_is_wrong_is_said_in_one_line(motions, change, line):
    content = {key: value for key, value in {**arrays(motions.raw(30)), **change}.items() if value is not None}
    with pytest.raises(BadInput, match=line) as caught:
        read(motions, content)
    assert "\n" not in str(caught.value) and NAME in str(caught.value)


def test_a_frame_without_numbers_hides_no_order_and_is_named_by_the_checks(motions):
    content = arrays(motions.raw(30), "breadth_first")
    content["body_pos_w"][0] = np.nan
    with pytest.raises(BadInput, match=r"row 0, root position x: expected a finite number, came nan"):
        usable(read(motions, content))


def test_truncated_files_and_pickled_objects_are_refused(motions):
    whole = npz(arrays(motions.raw(30)))
    path = motions.folder / NAME
    for size in (0, 10, len(whole) // 2, len(whole) - 3):
        with pytest.raises(BadInput, match=r"isaac\.npz"):
            read_robot(path, whole[:size])
    stream = io.BytesIO()
    np.savez(stream, joint_pos=np.array([{}, 1], dtype=object))
    with pytest.raises(BadInput, match=r"pickled objects\. Nothing of it was executed"):
        read_robot(path, stream.getvalue())


def test_a_persons_npz_is_told_from_a_robots(motions):
    assert is_robot_npz(npz(arrays(motions.raw(12)))) and is_robot_npz(npz({"dof_pos": np.zeros(3)}))
    smpl = npz({"poses": np.zeros((4, 72)), "trans": np.zeros((4, 3))})
    assert not is_robot_npz(smpl) and not is_robot_npz(smpl[:40]) and not is_robot_npz(b"")
    with pytest.raises(BadInput, match=r"expected joint_pos and body_pos_w .*, came poses, trans"):
        read_robot(motions.folder / "a.npz", smpl)
    assert zipfile.is_zipfile(io.BytesIO(smpl))
