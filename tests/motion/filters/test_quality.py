"""Each measure sees what it is there for, in its unit, and nothing else."""

from dataclasses import replace

import numpy as np
import pytest

from bumblebee.motion.clip import Clip
from bumblebee.motion.filters.quality import at_times, joint_error, keypoint_error, quality
from bumblebee.motion.human.motion import LANDMARKS
from bumblebee.motion.kinematics import lowest, make_clip
from bumblebee.robot.facts import joint_names, joints, stand_pose

FPS, FRAMES = 50.0, 120


def standing(drift=(0.0, 0.0, 0.0), height=0.0, joint_pos=None) -> Clip:
    """A robot that stands, moved as a whole by `drift` [m/s], at a height (T,) or number [m]."""
    time = np.arange(FRAMES) / FPS
    joint_pos = np.tile(stand_pose(), (FRAMES, 1)) if joint_pos is None else joint_pos
    root_quat = np.tile([1.0, 0.0, 0.0, 0.0], (FRAMES, 1))
    root_pos = np.multiply.outer(time, drift)
    root_pos[:, 2] += height - lowest(root_pos, root_quat, joint_pos)
    return make_clip("stand", FPS, root_pos, root_quat, joint_pos)


def moved(joint: str, by: np.ndarray) -> np.ndarray:
    """The stand with one joint moved by (T,) [rad]."""
    joint_pos = np.tile(stand_pose(), (FRAMES, 1))
    joint_pos[:, joint_names().index(joint)] += by
    return joint_pos


def person(feet: np.ndarray) -> np.ndarray:
    """Landmarks (T, 18, 3) of which only the feet matter: both at (T, 3)."""
    positions = np.ones((FRAMES, len(LANDMARKS), 3))
    for name in ("left_ankle", "left_toe", "right_ankle", "right_toe"):
        positions[:, LANDMARKS.index(name)] = feet
    return positions


def test_a_robot_that_stands_still_on_the_floor_has_no_fault():
    found = quality(standing())
    assert found.pop("contact_share") == 1.0
    assert found == pytest.approx(dict.fromkeys(found, 0.0), abs=0.01)


@pytest.mark.parametrize(
    ("height", "wanted"),
    [
        (0.03, {"floating_mm": 30, "floating_p99_mm": 30, "penetration_mm": 0}),
        (-0.02, {"floating_mm": 0, "penetration_mm": 20, "penetration_p1_mm": 20}),
    ],
)
def test_heights_are_told_in_millimetres(height: float, wanted: dict):
    found = quality(standing(height=height))
    assert {key: found[key] for key in wanted} == pytest.approx(wanted, abs=0.01)


def test_one_frame_under_the_floor_is_the_worst_and_not_the_percentile():
    height = np.zeros(FRAMES)
    height[60] = -0.04
    found = quality(standing(height=height))
    assert found["penetration_mm"] == pytest.approx(40, abs=0.01)
    assert found["penetration_p1_mm"] < 15


def test_a_hop_under_gravity_is_no_floating_and_the_same_rise_held_is():
    time = np.arange(FRAMES) / FPS
    hop = np.clip(2.0 * (time - 0.8) - 4.905 * (time - 0.8) ** 2, 0, None)  # 0.41 s in the air, 0.2 m high
    hang = hop.max() * np.clip(np.minimum(time - 0.4, 2.0 - time) / 0.4, 0, 1)
    assert quality(standing(height=hop))["floating_mm"] < 10
    assert quality(standing(height=hang))["floating_mm"] == pytest.approx(1000 * hop.max(), abs=1)


@pytest.mark.parametrize("height", [0.0, 0.05])
def test_feet_that_slide_skate_as_fast_also_over_a_floor_that_floats(height: float):
    found = quality(standing(drift=(0.08, 0.06, 0.0), height=height))
    assert (found["skate_mm_s"], found["skate_p99_mm_s"]) == pytest.approx((100, 100), abs=0.5)


def test_contact_is_told_by_the_person_where_there_is_one():
    slides = standing(drift=(0.1, 0.0, 0.0), height=0.02)
    on_floor = quality(slides, person(np.zeros((FRAMES, 3))))
    assert on_floor["skate_mm_s"] == pytest.approx(100, abs=0.5)
    assert on_floor["floating_mm"] == pytest.approx(20, abs=0.01)
    runs = person(np.multiply.outer(np.arange(FRAMES) / FPS, [2.0, 0.0, 0.0]))
    away = quality(slides, runs)
    assert away["contact_share"] == 0.0
    assert np.isnan(away["skate_mm_s"]) and np.isnan(away["floating_mm"])


def test_a_person_of_another_length_is_refused():
    with pytest.raises(ValueError, match="119 frames of the person"):
        quality(standing(), person(np.zeros((FRAMES, 3)))[1:])


def test_joints_beyond_their_range_are_counted_by_frames_and_by_the_worst():
    knee = joints()[joint_names().index("left_knee_joint")]
    by = np.zeros(FRAMES)
    by[30:42] = knee.range[0] - stand_pose()[joint_names().index("left_knee_joint")] - 0.2
    found = quality(standing(joint_pos=moved("left_knee_joint", by)))
    assert found["limit_frames"] == pytest.approx(12 / FRAMES)
    assert found["limit_excess_rad"] == pytest.approx(0.2, abs=1e-5)


def test_steps_faster_than_the_motor_are_counted_by_joint():
    by = np.where(np.arange(FRAMES) < 60, 0.0, 0.9)  # 45 rad/s once; the motor does 37
    limit = joints()[joint_names().index("left_elbow_joint")].velocity_limit
    found = quality(standing(joint_pos=moved("left_elbow_joint", by)))
    assert found["velocity_share"] == pytest.approx(1 / ((FRAMES - 1) * 23))
    assert found["velocity_excess_rad_s"] == pytest.approx(45 - limit, abs=1e-3)


def test_jerk_is_the_third_derivative():
    time, pace = np.arange(FRAMES) / FPS, 2 * np.pi * 2.5
    found = quality(standing(joint_pos=moved("left_elbow_joint", 0.3 * np.sin(pace * time))))
    # A joint of 23; differences of a sine are smaller by sinc.
    wanted = 0.3 * (2 * FPS * np.sin(pace / 2 / FPS)) ** 3 * 2 / np.pi / 23
    assert found["jerk_rad_s3"] == pytest.approx(wanted, rel=0.02)


@pytest.mark.parametrize(("starts_off", "worse"), [(0.0, False), (0.5, True)])
def test_a_first_frame_that_is_worse_than_the_rest_is_told(starts_off: float, worse: bool):
    by = 0.2 * np.sin(np.arange(FRAMES) / 20)
    by[0] += starts_off
    assert (quality(standing(joint_pos=moved("left_elbow_joint", by)))["first_step"] > 1.5) is worse


def test_too_short_a_motion_has_no_jerk_and_ends_in_no_error():
    whole = standing()
    names = ("root_pos", "root_quat", "joint_pos", "key_pos")
    one = quality(replace(whole, **{name: getattr(whole, name)[:1] for name in names}))
    assert np.isnan(one["jerk_rad_s3"]) and np.isnan(one["first_step"]) and np.isnan(one["skate_mm_s"])
    assert one["root_speed_m_s"] == 0.0


def test_errors_between_motions_of_different_rates_are_taken_at_common_times():
    by = 0.1 * np.arange(FRAMES) / FPS
    fast = standing(joint_pos=moved("left_elbow_joint", by))
    slow = make_clip("slow", FPS / 2, fast.root_pos[:100:2], fast.root_quat[:100:2], fast.joint_pos[:100:2])
    assert joint_error(fast, slow) == pytest.approx(0.0, abs=1e-6)
    other = make_clip("other", FPS, np.add(fast.root_pos, [0.03, 0.0, 0.04]), fast.root_quat, fast.joint_pos)
    assert keypoint_error(fast, other) == pytest.approx({"global_mm": 50, "root_relative_mm": 0}, abs=0.01)
    turned = standing(joint_pos=moved("left_elbow_joint", by + 0.23))
    assert joint_error(fast, turned) == pytest.approx(0.01, abs=1e-6)
    assert keypoint_error(fast, turned)["root_relative_mm"] > 1


def test_values_between_frames_are_linear_and_stay_within_the_motion():
    assert at_times(np.array([0.0, 2.0, 4.0]), 10.0, np.array([0.05, 0.2, 9.0])) == pytest.approx([1.0, 4.0, 4.0])
