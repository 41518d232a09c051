"""Two layouts of 23 joints: names, rotations about axes and bodies tell which, nothing is read for the other."""

import joblib
import numpy as np
import pytest

from bumblebee.errors import BadInput
from bumblebee.motion.formats.asap_pickle import read_asap_pickle
from bumblebee.motion.formats.config import RobotConfig
from bumblebee.motion.formats.g1_csv import read_g1_csv
from bumblebee.motion.formats.layouts import NOTE, arranged, layouts
from bumblebee.motion.formats.read import read_robot
from bumblebee.motion.reading.usable import usable
from bumblebee.robot.facts import joint_names, joints
from tests.motion.formats.test_mjlab_npz import arrays, npz
from tests.motion.formats.test_pickle_variants import same

UNITREE = layouts(23)["unitree"]
WAIST = [joint_names().index(name) for name in ("waist_roll_joint", "waist_pitch_joint")]


def locked(motions):
    """A motion that a G1 with one waist joint can do."""
    joint_pos = motions.raw().joint_pos.copy()
    joint_pos[:, WAIST] = 0
    return motions.raw(joint_pos=joint_pos)


def columns(raw) -> np.ndarray:
    """Its 23 joints as Unitree's G1 of 23 has them, the wrists rolled."""
    own = {name: raw.joint_pos[:, number] for number, name in enumerate(joint_names())}
    return np.stack([own.get(name, np.full(len(raw.joint_pos), 0.7)) for name in UNITREE], axis=1)


def test_unitrees_own_23_joints_are_those_of_its_model():
    legs, arm = (
        list(joint_names(every=True)[:12]),
        ("shoulder_pitch", "shoulder_roll", "shoulder_yaw", "elbow", "wrist_roll"),
    )
    arms = [f"{side}_{name}_joint" for side in ("left", "right") for name in arm]
    assert list(UNITREE) == [*legs, "waist_yaw_joint", *arms]


def test_columns_of_the_other_layout_are_put_where_their_joints_are(motions):
    raw = locked(motions)
    np.testing.assert_array_equal(arranged(columns(raw), UNITREE), raw.joint_pos)
    np.testing.assert_array_equal(arranged(raw.joint_pos, joint_names()), raw.joint_pos)


def test_a_csv_is_read_by_its_names_or_by_the_layout_that_is_set(motions):
    raw = locked(motions)
    table = np.concatenate([raw.root_pos, raw.root_quat[:, [1, 2, 3, 0]], columns(raw)], axis=1)
    path = motions.folder / "a.csv"
    np.savetxt(path, table, delimiter=",")
    with pytest.raises(BadInput, match="names of the joints, came 23 joints without names"):
        read_g1_csv(path, 30)
    came = read_g1_csv(path, 30, options=RobotConfig(joints_23="unitree"))
    same(came, raw)
    assert came.notes == (NOTE,)
    np.savetxt(path, table, delimiter=",", header=",".join([*"xyzabcd", *UNITREE]), comments="")
    same(read_g1_csv(path, 30), raw)


def test_a_pickle_is_read_by_its_names_or_by_the_axes_of_pose_aa(motions):
    raw = locked(motions)
    pose = np.zeros((80, 27, 3))
    axes = {joint.name: joint.axis for joint in joints(every=True)}
    for number, name in enumerate(UNITREE):
        pose[:, 1 + number] = columns(raw)[:, number, None] * np.array(axes[name])
    pose[:, 0] = motions.fields(raw)["pose_aa"][:, 0]
    for fields in ({"pose_aa": None, "joint_names": list(UNITREE)}, {"pose_aa": pose}, {"pose_aa": pose, "dof": None}):
        fields = {"dof": columns(raw), **fields}
        content = {key: value for key, value in motions.fields(raw, **fields).items() if value is not None}
        path = motions.folder / "a.pkl"
        joblib.dump({"walk": content}, path)
        (came,) = read_asap_pickle(path)
        same(came, raw)
        assert NOTE in came.notes


def test_bodies_tell_the_layout_of_an_npz(motions):
    raw = locked(motions)
    content = arrays(raw)
    content["joint_pos"] = columns(raw)
    (came,) = read_robot(motions.folder / "a.npz", npz(content), None)
    same(came, raw)
    assert NOTE in came.notes and "depth-first" in came.notes[0]


@pytest.mark.parametrize("rate", ["fps", "framerate"])
@pytest.mark.parametrize("order", ["wxyz", "xyzw"])
def test_isaac_labs_export_is_read_by_its_names(motions, rate, order):
    raw = motions.raw(yaw=np.pi)
    names = np.random.default_rng(0).permutation(joint_names(every=True))
    wide = np.zeros((80, 29))
    for number, name in enumerate(joint_names()):
        wide[:, list(names).index(name)] = raw.joint_pos[:, number]
    quat = raw.root_quat[:, ["wxyz".index(part) for part in order]]
    content = {rate: 30.0, "joint_names": names, "joint_pos": wide, "base_pos_w": raw.root_pos, "base_quat_w": quat}
    (came,) = read_robot(motions.folder / "a.npz", npz(content), None)
    same(usable(came), raw)
    assert came.fps == 30
