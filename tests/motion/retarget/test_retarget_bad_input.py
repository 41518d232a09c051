"""Motions that no robot can follow and mappings that do not fit: one line each."""

from copy import deepcopy
from pathlib import Path

import mujoco
import numpy as np
import pytest
import yaml

from bumblebee.errors import BadInput
from bumblebee.motion.human.motion import LANDMARKS, HumanMotion
from bumblebee.motion.retarget.mapping import make_robot, read_robot
from bumblebee.motion.retarget.retarget import retarget
from tests.motion.retarget.robots import H1, mapping, small_model
from tests.motion.retarget.stepping import standing


def _spoilt(frame: int, landmark: str, value: float) -> HumanMotion:
    motion = standing()
    motion.positions[frame, LANDMARKS.index(landmark), 1] = value
    return motion


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e300])
def test_a_position_that_is_none_is_named(value):
    with pytest.raises(BadInput, match=r"frame 8, left_wrist: expected a position within 1000 m.*1 such values"):
        retarget(_spoilt(7, "left_wrist", value))


def test_legs_without_length_are_refused():
    motion = standing()
    motion.positions[:, LANDMARKS.index("left_knee")] = motion.landmark("left_hip")
    with pytest.raises(BadInput, match=r"left_hip to left_knee: expected at least 0\.03 m apart"):
        retarget(motion)


def test_a_person_with_all_landmarks_in_one_place_is_refused():
    with pytest.raises(BadInput, match="apart"):
        retarget(HumanMotion("none", 50.0, np.zeros((20, 18, 3)), Path("none.bvh")))


@pytest.mark.parametrize("frames", [0, 1, 2, 4])
def test_too_few_frames_are_refused(frames):
    with pytest.raises(BadInput, match="at least"):
        retarget(standing(frames))


@pytest.mark.parametrize("fps", [0.0, -30.0, np.nan, np.inf, 1e9])
def test_a_rate_that_is_none_is_refused(fps):
    with pytest.raises(BadInput, match="a frame rate from 1 to 1000 Hz"):
        retarget(HumanMotion("rate", fps, standing().positions, Path("rate.bvh")))


def test_an_hour_and_more_is_refused():
    long = np.broadcast_to(standing(2).positions[:1], (3601, 18, 3))
    with pytest.raises(BadInput, match="at most 3600 s"):
        retarget(HumanMotion("long", 1.0, long, Path("long.bvh")))


@pytest.mark.parametrize("still", ["shoulder", "hip"])
def test_a_person_whose_sides_coincide_gives_numbers(still):
    motion = standing()
    motion.positions[:, LANDMARKS.index(f"left_{still}")] = motion.landmark(f"right_{still}")
    assert np.isfinite(retarget(motion).joint_pos).all()


WRONG = [None, True, [], {}, "x", float("nan"), float("inf"), 10**400, -1e9, [[[]]], {"a": {}}, b"x", [1, 2, 3, 4]]


@pytest.mark.parametrize("value", WRONG, ids=lambda value: repr(value)[:20])
@pytest.mark.parametrize(
    "place",
    [
        ("robot",),
        ("points",),
        ("points", "neck"),
        ("points", "neck", 0),
        ("points", "neck", 1),
        ("points", "neck", 1, 2),
        ("soles",),
        ("soles", "left"),
        ("soles", "left", 0),
        ("soles", "left", 1),
        ("soles", "left", 1, 3),
        ("sole_radius",),
        ("joint_speed",),
        ("joint_speed", "left_knee"),
        ("rest",),
        ("rest", "left_knee"),
        ("nonsense",),
    ],
    ids=lambda place: ".".join(map(str, place)),
)
def test_a_wrong_value_under_any_key_is_one_line(place, value):
    content = deepcopy(mapping()) | {"joint_speed": {"left_knee": 10.0}, "rest": {"left_knee": 0.3}}
    holder = content
    for key in place[:-1]:
        holder = holder[key]
    holder[place[-1]] = value
    if (place, repr(value)) in FINE:
        make_robot("small.yaml", content, MODEL)
        return
    with pytest.raises(BadInput, match=r"small\.yaml") as said:
        make_robot("small.yaml", content, MODEL)
    assert len(str(said.value)) < 600 and "\n" not in str(said.value)


MODEL = small_model()
FINE = {(("robot",), "'x'"), (("joint_speed",), "{}"), (("rest",), "{}")}


@pytest.mark.parametrize("whole", [None, 3, "text", [], {}, {"points": {}}, {1: 2}])
def test_what_is_no_mapping_at_all_is_one_line(whole):
    with pytest.raises(BadInput, match=r"small\.yaml"):
        make_robot("small.yaml", whole, MODEL)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"left_knee": "left_thigh"}, "left_hip and left_knee apart"),
        ({"left_wrist": "left_fore"}, "left_elbow and left_wrist apart"),
        ({"right_hip": "left_thigh", "right_knee": "left_shin"}, "left_hip and right_hip apart"),
        ({"neck": "left_thigh"}, "left_hip and neck apart"),
        ({"neck": "head"}, "a body of the model"),
        ({"tail": "trunk"}, "unknown 'tail'"),
    ],
)
def test_points_that_make_no_body_are_refused(change, said):
    content = mapping()
    content["points"] |= change
    with pytest.raises(BadInput, match=said):
        make_robot("small.yaml", content, MODEL)


def test_soles_without_length_or_on_the_trunk_are_refused():
    content = mapping()
    content["soles"]["left"] = ["left_foot", [[0.0, 0.0, -0.04]] * 4]
    with pytest.raises(BadInput, match="heel and toe apart"):
        make_robot("small.yaml", content, MODEL)
    content["soles"]["left"] = ["trunk", mapping()["soles"]["left"][1]]
    with pytest.raises(BadInput, match="bodies below a joint"):
        make_robot("small.yaml", content, MODEL)


def test_a_rest_beyond_a_joints_range_is_brought_into_it():
    robot = make_robot("small.yaml", mapping() | {"rest": {"knee": -1.0}}, MODEL)
    knee = [robot.tree.joints.index(f"{side}_knee") for side in ("left", "right")]
    np.testing.assert_array_equal(robot.rest[knee], robot.tree.low[knee])


def test_a_number_for_all_joints_or_names_without_side():
    robot = make_robot("small.yaml", mapping() | {"joint_speed": 7, "rest": {"elbow": -0.5}}, MODEL)
    assert (robot.fastest == 7).all()
    elbows = [robot.tree.joints.index(f"{side}_elbow") for side in ("left", "right")]
    np.testing.assert_array_equal(robot.rest[elbows], -0.5)


@pytest.mark.parametrize(
    "text", ["", "<mujoco", "<mujoco><worldbody><body/></worldbody></mujoco>", "<urdf/>", "\0", None]
)
def test_a_model_that_does_not_load_is_one_line(tmp_path, text):
    model = tmp_path / "robot.xml"
    if text is not None:
        model.write_text(text)
    with pytest.raises(BadInput, match=r"robot\.xml"):
        read_robot(model, H1 / "h1.yaml")


@pytest.mark.parametrize("text", ["", "a: [", "points: *none", "{{{", "points: !!python/object:os.system {}"])
def test_a_mapping_that_is_no_yaml_is_one_line(tmp_path, text):
    (tmp_path / "map.yaml").write_text(text)
    with pytest.raises(BadInput, match=r"map\.yaml"):
        read_robot(H1 / "h1.xml", tmp_path / "map.yaml")


def test_a_mapping_of_another_robot_names_the_bodies_that_there_are(tmp_path):
    (tmp_path / "map.yaml").write_text(yaml.safe_dump(mapping()))
    with pytest.raises(BadInput, match=r"a body of the model, came 'left_thigh'. Bodies: pelvis, left_hip_yaw_link"):
        read_robot(H1 / "h1.xml", tmp_path / "map.yaml")


def test_meshes_that_are_missing_are_one_line(tmp_path):
    text = mujoco.MjSpec.from_file(str(H1 / "h1.xml")).to_xml()
    (tmp_path / "robot.xml").write_text(text.replace("<worldbody>", '<asset><mesh file="no.stl"/></asset><worldbody>'))
    with pytest.raises(BadInput, match="an MJCF that MuJoCo loads"):
        read_robot(tmp_path / "robot.xml", H1 / "h1.yaml")
