"""Each check refuses exactly the mistake that it is for, by file and frame."""

import numpy as np
import pytest

from bumblebee.errors import BadInput
from bumblebee.motion.checks import check_raw
from bumblebee.motion.formats.g1_csv import read_g1_csv
from bumblebee.motion.kinematics import lowest
from bumblebee.quaternions import from_axis_angle, multiply
from bumblebee.robot.facts import joint_names


def refused(raw, line: str) -> None:
    with pytest.raises(BadInput, match=line) as caught:
        check_raw(raw)
    assert "sway.csv" in str(caught.value) and "\n" not in str(caught.value)


def test_a_good_motion_passes(motions):
    check_raw(motions.raw())


@pytest.mark.parametrize("frames", [1, 3, 9])
def test_few_frames(motions, frames):
    refused(motions.raw(frames), f"at least 10 frames, came {frames} frame")


@pytest.mark.parametrize("value", [np.nan, np.inf])
@pytest.mark.parametrize(
    ("field", "column", "name"),
    [("root_pos", 2, "root position z"), ("root_quat", 0, "root quaternion w"), ("joint_pos", 3, joint_names()[3])],
)
def test_numbers_that_are_not_finite(motions, value, field, column, name):
    raw = motions.raw()
    getattr(raw, field)[7, column] = value
    refused(raw, f"row 8, {name}: expected a finite number, came {value}. 1 such values")


def test_quaternions_of_another_length(motions):
    raw = motions.raw()
    raw.root_quat[5] *= 1.5
    refused(raw, "row 6, root quaternion: expected length 1, came 1.5")


def test_degrees(motions):
    refused(motions.raw(joint_pos=np.degrees(motions.raw().joint_pos)), "expected radians, came .* Degrees")


def test_centimetres(motions):
    refused(motions.raw(root_pos=motions.raw().root_pos * 100), "expected metres, came 7.* Centimetres")


@pytest.mark.parametrize("yaw", [0.0, 0.4, -1.2, 1.8, 2.4])
def test_wxyz_where_xyzw_is_due(motions, yaw):
    raw = motions.raw(yaw=yaw)
    refused(read_g1_csv(motions.csv(raw, order="wxyz"), 30), "expected the order xyzw, came wxyz .* Move w to the end")
    check_raw(read_g1_csv(motions.csv(raw, order="xyzw"), 30))


@pytest.mark.parametrize("yaw", np.linspace(-np.pi, np.pi, 9))
@pytest.mark.parametrize("pitch", [0.0, 0.3, 0.9, 1.5, -1.5])
def test_motions_bent_far_over_are_not_taken_for_the_wrong_order(motions, yaw, pitch):
    raw = motions.raw(yaw=yaw)
    bent = multiply(raw.root_quat, from_axis_angle([0.0, 1.0, 0.0], np.full(len(raw.root_pos), pitch)))
    on_floor = raw.root_pos - lowest(raw.root_pos, bent, raw.joint_pos)[:, None] * [0.0, 0.0, 1.0]
    check_raw(motions.raw(root_quat=bent, root_pos=on_floor))
    check_raw(motions.raw(root_quat=bent, root_pos=on_floor + np.array([0.0, 0.0, 0.15])))
