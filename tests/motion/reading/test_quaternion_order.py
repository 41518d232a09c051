"""The order of a quaternion that nobody states is told by the foot that stands, or it is asked for."""

from dataclasses import replace

import numpy as np
import pytest

from bumblebee import quaternions
from bumblebee.errors import BadInput
from bumblebee.motion.formats.config import RobotConfig
from bumblebee.motion.formats.g1_csv import read_g1_csv
from bumblebee.motion.formats.read import read_robot
from bumblebee.motion.reading.usable import usable
from bumblebee.robot.facts import joint_names
from tests.motion.conftest import standing

ABOUT_Y = (0.0, 1.0, 0.0)


def bent(motions, yaw: float, pitch: float):
    """The sway with the trunk bent forward over legs that stay as they are."""
    raw = motions.raw(yaw=yaw)
    quat = quaternions.multiply(raw.root_quat, quaternions.from_axis_angle(ABOUT_Y, np.full(len(raw.root_quat), pitch)))
    joints = raw.joint_pos.copy()
    joints[:, [joint_names().index(f"{side}_hip_pitch_joint") for side in ("left", "right")]] -= pitch
    return replace(raw, root_quat=quat, joint_pos=joints, root_pos=standing(quat, joints))


def turned(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.abs(np.abs((a * b).sum(axis=1)) - 1).max())


@pytest.mark.parametrize("yaw", [*np.linspace(-np.pi, np.pi, 9), 0.05, 3.1])
@pytest.mark.parametrize("pitch", [0.0, 0.3, 0.9, 1.5])
def test_a_csv_in_either_order_is_read_as_it_is_at_every_heading(motions, yaw, pitch):
    raw = bent(motions, yaw, pitch)
    for order in ("xyzw", "wxyz"):
        came = usable(read_g1_csv(motions.csv(raw, order=order), 30))
        assert turned(came.root_quat, raw.root_quat) < 1e-6
        assert [note.partition(":")[0] for note in came.notes] == ["root quaternions wxyz"] * (order == "wxyz")


@pytest.mark.parametrize("forwards", [-1, 1])
def test_a_robot_that_walks_backwards_is_not_taken_for_the_other_order(motions, forwards):
    """Its velocity against its heading would tell the wrong order: the foot that stands does not."""
    time = np.arange(120) / 30
    raw = motions.raw(120, yaw=np.pi)
    quat = np.tile([0.0, 0, 0, 1.0], (120, 1))
    joints = raw.joint_pos.copy()
    hip = joint_names().index("left_hip_pitch_joint")
    joints[:, hip] += forwards * 0.5 * (time / 4 - 0.5)  # the standing leg swings by half a radian
    raw = replace(raw, root_quat=quat, joint_pos=joints, root_pos=standing(quat, joints))
    for order in ("xyzw", "wxyz"):
        assert turned(usable(read_g1_csv(motions.csv(raw, order=order), 30)).root_quat, quat) < 1e-6


def test_a_robot_that_does_not_move_is_asked_for_its_order(motions):
    raw = motions.raw(yaw=np.pi, joint_pos=np.tile(motions.raw().joint_pos[0], (80, 1)))
    still = replace(raw, root_quat=np.tile([0.0, 0, 0, 1.0], (80, 1)), root_pos=np.tile(raw.root_pos[0], (80, 1)))
    path = motions.csv(still)
    with pytest.raises(BadInput, match=r"does not tell it .*--set quaternion=xyzw or --set quaternion=wxyz"):
        usable(read_g1_csv(path, 30))
    for order, expected in (("xyzw", [0.0, 0, 0, 1]), ("wxyz", [0.0, 0, 1, 0])):
        came = usable(read_g1_csv(path, 30, options=RobotConfig(quaternion=order)))
        assert turned(came.root_quat, np.tile(expected, (80, 1))) < 1e-6


def test_names_that_the_motion_contradicts_are_asked_about(motions):
    raw = motions.raw(yaw=1.8)
    names = ["x", "y", "z", "qw", "qx", "qy", "qz", *joint_names()]
    path = motions.csv(raw, dof=23, order="xyzw", header=",".join(names))
    with pytest.raises(BadInput, match=r"wxyz as the file says, came a motion that contradicts it"):
        usable(read_g1_csv(path, 30))
    came = usable(read_g1_csv(path, 30, options=RobotConfig(quaternion="xyzw")))
    assert turned(came.root_quat, raw.root_quat) < 1e-6


def test_a_pickle_without_pose_aa_is_told_by_the_motion_too(motions):
    raw = motions.raw(yaw=np.pi)
    path = motions.pickle(raw, pose_aa=None, joint_names=list(joint_names()), root_rot=raw.root_quat)
    (came,) = read_robot(path, path.read_bytes(), RobotConfig())
    assert turned(usable(came).root_quat, raw.root_quat) < 1e-6
