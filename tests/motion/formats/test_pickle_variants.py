"""PHC's, H2O's, GMR's and TWIST's pickles: other names, joint angles inside `pose_aa`, quaternions that it tells."""

import pickle

import joblib
import numpy as np
import pytest

from bumblebee.errors import BadInput
from bumblebee.motion.formats.asap_pickle import read_asap_pickle
from bumblebee.motion.formats.config import RobotConfig
from bumblebee.robot.facts import joint_names
from tests.motion.conftest import pose_of


def same(came, raw):
    for name in ("root_pos", "root_quat", "joint_pos"):
        np.testing.assert_allclose(getattr(came, name), getattr(raw, name), atol=1e-6)


def test_gmr_and_twist_files_are_read_with_what_else_they_carry(motions, tmp_path):
    raw = motions.raw()
    content = {
        "fps": 30.0,
        "root_pos": raw.root_pos,
        "root_rot": raw.root_quat[:, [1, 2, 3, 0]],
        "dof_pos": raw.joint_pos,
        "dof_names": list(joint_names()),
        "local_body_pos": None,
        "link_body_list": ["pelvis", "torso_link"],
    }
    (tmp_path / "gmr.pkl").write_bytes(pickle.dumps(content))
    (came,) = read_asap_pickle(tmp_path / "gmr.pkl")
    same(came, raw)
    assert came.fps == 30 and came.rate_from == "file"


@pytest.mark.parametrize(("dof", "extended"), [(23, 0), (23, 3), (29, 0), (29, 3)])
def test_joint_angles_come_from_pose_aa_where_there_is_no_dof(motions, dof, extended):
    raw = motions.raw()
    fields = motions.fields(raw, pose_aa=pose_of(raw, dof, extended))
    del fields["dof"], fields["root_rot"]
    joblib.dump({"walk": fields}, motions.folder / "a.pkl")
    (came,) = read_asap_pickle(motions.folder / "a.pkl")
    same(came, raw)
    assert came.notes == ("joint angles from pose_aa", "root rotation from pose_aa")


def test_a_pose_of_another_body_is_refused(motions):
    pose = pose_of(motions.raw(), extended=0)
    pose[:, 5] += [0.2, 0.1, 0.3]  # SMPL has as many bodies, whose joints turn about any axis
    fields = motions.fields(motions.raw(), pose_aa=pose)
    del fields["dof"]
    joblib.dump({"walk": fields}, motions.folder / "a.pkl")
    with pytest.raises(BadInput, match=r"pose_aa: expected rotations about the 23 joint axes of the G1, came 0\.\d+"):
        read_asap_pickle(motions.folder / "a.pkl")


def test_pose_aa_tells_quaternions_of_the_other_order_and_contradictions(motions):
    raw = motions.raw()
    path = motions.pickle(raw, pose_aa=pose_of(raw), root_rot=raw.root_quat)
    (came,) = read_asap_pickle(path)
    same(came, raw)
    assert came.notes == ("root quaternions wxyz, as pose_aa tells",)
    path = motions.pickle(raw, pose_aa=pose_of(motions.raw(yaw=1.4)))
    with pytest.raises(BadInput, match=r"root_rot: expected the same rotation as in pose_aa, came 1\.00 rad apart"):
        read_asap_pickle(path)


def test_a_pose_of_zeros_says_nothing(motions):
    raw = motions.raw()
    path = motions.pickle(raw, pose_aa=np.zeros((80, 27, 3)))
    (came,) = read_asap_pickle(path, options=RobotConfig(joints_23="asap"))
    same(came, raw)
    with pytest.raises(
        BadInput, match=r"came 23 joints without names.*--set joints_23=asap or --set joints_23=unitree"
    ):
        read_asap_pickle(path)
