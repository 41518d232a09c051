"""A header decides what the columns of a CSV file are; units and orders that nothing states are asked for."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bumblebee.errors import BadInput
from bumblebee.motion.formats.config import RobotConfig
from bumblebee.motion.formats.g1_csv import read_g1_csv
from bumblebee.motion.reading.usable import usable
from bumblebee.robot.facts import joint_names

SOMA = ["root_translateX", "root_translateY", "root_translateZ", "root_rotateX", "root_rotateY", "root_rotateZ"]
TURNED = (0.3, -0.4, 0.9)  # rad about x, y, z


def soma(motions, name="soma.csv", header=SOMA, metres=0.01, degrees=True, order="xyz", frames=40, **changed):
    """A motion that leans about all three axes, as the SOMA retargeter writes it; and what it is."""
    raw = motions.raw(frames)
    euler = np.tile(TURNED, (frames, 1)) + 0.1 * np.arange(frames)[:, None] / frames
    quat = Rotation.from_euler(order, euler).as_quat()[:, [3, 0, 1, 2]]
    euler = euler[:, [order.lower().index(axis) for axis in "xyz"]]
    joints = np.zeros((frames, 29))
    joints[:, [joint_names(every=True).index(joint) for joint in joint_names()]] = raw.joint_pos
    unit = 180 / np.pi if degrees else 1.0
    counter = np.arange(frames)[:, None]
    table = np.concatenate([counter, raw.root_pos / metres, euler * unit, joints * unit], axis=1)
    for (row, column), value in changed.get("cells", {}).items():
        table[row, column] = value
    names = ["Frame", *header, *(f"{joint}_dof" for joint in joint_names(every=True))]
    path = motions.folder / name
    np.savetxt(path, table, fmt="%.9f", delimiter=",", header=",".join(names), comments="")
    return path, raw, quat


def same_rotation(came, wanted):
    return np.abs((came * wanted).sum(axis=1)).min() > 1 - 1e-9


def test_the_layout_of_bones_seed_is_centimetres_degrees_and_fixed_axes(motions):
    path, raw, quat = soma(motions)
    came = read_g1_csv(path, 120)
    np.testing.assert_allclose(came.root_pos, raw.root_pos, atol=1e-9)
    np.testing.assert_allclose(came.joint_pos, raw.joint_pos, atol=1e-9)
    assert same_rotation(came.root_quat, quat)
    assert came.fps == 120 and came.rate_from == "setting"
    assert came.notes == ("cm, degrees, Euler angles xyz: as the SOMA retargeter writes (BONES-SEED)",)


def test_the_order_of_the_euler_angles_matters_and_can_be_set(motions):
    path, _, quat = soma(motions, order="XYZ")
    assert not same_rotation(read_g1_csv(path, 120).root_quat, quat)
    options = RobotConfig(csv_length="cm", csv_angle="deg", csv_euler="XYZ")
    assert same_rotation(read_g1_csv(path, 120, options=options).root_quat, quat)


@pytest.mark.parametrize("order", ["zyx", "YXZ", "zxy"])
def test_every_order_reads_the_columns_by_their_names(motions, order):
    path, _, quat = soma(motions, order=order)
    options = RobotConfig(csv_length="cm", csv_angle="deg", csv_euler=order)
    assert same_rotation(read_g1_csv(path, 120, options=options).root_quat, quat)


def test_metres_and_radians_under_the_same_names_are_refused_and_read_when_set(motions):
    metres, raw, _ = soma(motions, "metres.csv", metres=1.0)
    with pytest.raises(BadInput, match=r"root height: expected cm, came 0\.7\d+ in the median\. .*csv_length"):
        read_g1_csv(metres, 120)
    radians, _, _ = soma(motions, "radians.csv", degrees=False)
    with pytest.raises(BadInput, match=r"joint angles: expected degrees, came none above 0\.\d+.*csv_angle"):
        read_g1_csv(radians, 120)
    both, raw, quat = soma(motions, "both.csv", metres=1.0, degrees=False)
    options = RobotConfig(csv_length="m", csv_angle="rad", csv_euler="xyz")
    came = read_g1_csv(both, 120, options=options)
    np.testing.assert_allclose(came.root_pos, raw.root_pos, atol=1e-9)
    np.testing.assert_allclose(came.joint_pos, raw.joint_pos, atol=1e-9)
    assert same_rotation(came.root_quat, quat)


def test_units_that_no_known_layout_states_are_asked_for(motions):
    header = ["pelvis_x", "pelvis_y", "pelvis_z", "roll_x", "pitch_y", "yaw_z"]
    path, _, quat = soma(motions, header=header)
    with pytest.raises(BadInput, match=r"row 1: expected units and order of the Euler angles.*no length and no angle"):
        read_g1_csv(path, 120)
    with pytest.raises(BadInput, match=r"which say no Euler order\. Say it: --set csv_length=cm"):
        read_g1_csv(path, 120, options=RobotConfig(csv_length="cm", csv_angle="deg"))
    options = RobotConfig(csv_length="cm", csv_angle="deg", csv_euler="xyz")
    assert same_rotation(read_g1_csv(path, 120, options=options).root_quat, quat)


def test_a_missing_frame_is_named(motions):
    path, _, _ = soma(motions, cells={(20, 0): 25.0})
    with pytest.raises(BadInput, match=r"row 22, frame number: expected 20, the next, came 25"):
        read_g1_csv(path, 120)


def test_a_bad_angle_is_named_by_the_checks(motions):
    path, _, _ = soma(motions, cells={(7, 5): np.nan})
    with pytest.raises(BadInput, match="row 9, root quaternion w: expected a finite number, came nan"):
        usable(read_g1_csv(path, 120))


@pytest.mark.parametrize("order", ["wxyz", "xyzw", "zyxw"])
def test_names_give_the_order_of_a_quaternion(motions, order):
    raw = motions.raw()
    names = ["root_x", "root_y", "root_z", *(f"quat_{part}" for part in order), *joint_names()]
    came = read_g1_csv(motions.csv(raw, dof=23, order=order, header=",".join(names)), 30)
    np.testing.assert_allclose(came.root_quat, raw.root_quat, atol=1e-8)


@pytest.mark.parametrize(
    ("header", "line"),
    [
        (["x", "y", *joint_names()], r"row 1: expected before the joints' columns 3 .*, came 2 columns"),
        (["x", "y", "y2", *"abcd", *joint_names()], r"row 1, column 1: expected names that end in x, y and z"),
        (
            [*"xyzabcd", *joint_names(), "waist_yaw"],
            r"row 1: expected each joint once, came waist_yaw_joint in columns",
        ),
        ([*"xyzabcd", *joint_names()[:5], "time", *joint_names()[5:]], r"column 13: .* unknown joint 'time'"),
        (["a", "b"], "row 1: expected each of the 23 joints .* came none for left_hip_pitch_joint"),
    ],
)
def test_a_header_that_fits_nothing_is_said(tmp_path, header, line):
    path = tmp_path / "a.csv"
    np.savetxt(path, np.zeros((20, len(header))), delimiter=",", header=",".join(header), comments="")
    with pytest.raises(BadInput, match=line) as caught:
        read_g1_csv(path, 30)
    assert "\n" not in str(caught.value)
