"""Each check refuses exactly the mistake that it is for, by file and frame."""

import numpy as np
import pytest

from bumblebee.errors import BadInput
from bumblebee.motion.reading.usable import usable
from bumblebee.robot.facts import joint_names


def refused(raw, line: str) -> None:
    with pytest.raises(BadInput, match=line) as caught:
        usable(raw)
    assert "sway.csv" in str(caught.value) and "\n" not in str(caught.value)


def test_a_good_motion_passes(motions):
    usable(motions.raw())


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


def test_interpolated_quaternions_are_made_unit_ones_with_a_note(motions):
    raw = motions.raw()
    short = raw.root_quat * np.linspace(0.96, 0.99, len(raw.root_quat))[:, None]
    came = usable(motions.raw(root_quat=short))
    np.testing.assert_allclose(came.root_quat, raw.root_quat, atol=1e-12)
    assert came.notes == ("root quaternions of length 0.96 to 0.99 made 1",) and usable(raw).notes == ()


def test_degrees(motions):
    refused(motions.raw(joint_pos=np.degrees(motions.raw().joint_pos)), "expected radians, came .* Degrees")


def test_centimetres(motions):
    refused(motions.raw(root_pos=motions.raw().root_pos * 100), "expected metres, came 7.* Centimetres")
