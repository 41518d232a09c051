"""The features see what a motion is, and not where it was recorded."""

from dataclasses import replace

import numpy as np
import pytest

from bumblebee import quaternions
from bumblebee.clustering.features import COLUMNS, TARGET_COLUMNS, fit_normaliser, heading, motion_windows, pad
from bumblebee.motion.clip import Clip
from bumblebee.motion.kinematics import make_clip
from tests.clustering.conftest import made_clip

WALK = made_clip("walk", "walk", seed=3, seconds=2.0)


def moved(clip: Clip, yaw: float, shift: tuple[float, float, float]) -> Clip:
    turn = np.array([np.cos(yaw / 2), 0.0, 0.0, np.sin(yaw / 2)])
    root_pos = quaternions.rotate(turn, clip.root_pos.astype(float)) + shift
    return make_clip(
        clip.name, clip.fps, root_pos, quaternions.multiply(turn, clip.root_quat.astype(float)), clip.joint_pos
    )


def column(window: np.ndarray, name: str) -> np.ndarray:
    return window[:, COLUMNS.index(name)]


@pytest.mark.parametrize("yaw", [0.4, 3.0])
def test_shift_and_turn_change_nothing(yaw: float) -> None:
    (before,), (after,) = motion_windows(WALK, 10.0, 8.0), motion_windows(moved(WALK, yaw, (5.0, -3.0, 0.0)), 10.0, 8.0)
    np.testing.assert_allclose(after, before, atol=2e-4)


def test_lift_is_seen() -> None:
    (before,), (after,) = motion_windows(WALK, 10.0, 8.0), motion_windows(moved(WALK, 0.0, (0.0, 0.0, 0.2)), 10.0, 8.0)
    np.testing.assert_allclose(column(after, "r.z") - column(before, "r.z"), 0.2, atol=1e-5)
    np.testing.assert_allclose(column(after, "p.head.z") - column(before, "p.head.z"), 0.2, atol=1e-5)


def test_walk_goes_forward_at_its_speed() -> None:
    """The root moves along x in its first heading; feet velocities average to the root's."""
    (window,) = motion_windows(WALK, 10.0, 8.0)
    speed = np.linalg.norm(WALK.root_pos[-1, :2] - WALK.root_pos[0, :2]) / WALK.duration
    np.testing.assert_allclose(column(window, "rdot.x"), speed, atol=1e-3)
    np.testing.assert_allclose(column(window, "rdot.y"), 0.0, atol=1e-3)
    np.testing.assert_allclose(column(window, "r.x"), speed * np.arange(len(window)) / 10.0, atol=1e-3)
    assert column(window, "r.x")[0] == column(window, "r.y")[0] == 0.0
    assert set(np.unique(column(window, "c.left"))) <= {0.0, 1.0}


def test_target_keeps_head_pelvis_hands_feet_and_all_the_rest() -> None:
    names = [COLUMNS[i] for i in TARGET_COLUMNS]
    kept = {name.split(".")[1] for name in names if name.startswith("p.")}
    feet, hands = (
        {f"{s}_ankle_roll_link" for s in ("left", "right")},
        {f"{s}_wrist_yaw_link" for s in ("left", "right")},
    )
    assert kept == {"pelvis", "head"} | hands | feet
    assert len(COLUMNS) == 15 * 3 + 3 + 3 + 2 + 6
    assert [n for n in names if not n.startswith("p.")] == [n for n in COLUMNS if not n.startswith("p.")]


def test_windows_are_equal_and_cover_the_clip() -> None:
    clip = made_clip("long", "walk", seconds=5.0)
    windows = motion_windows(clip, 10.0, 2.0)
    assert [len(window) for window in windows] == [17, 17, 16]
    assert all(column(window, "r.x")[0] == 0.0 for window in windows)


def test_short_clip_still_has_a_frame() -> None:
    clip = replace(WALK, **{n: getattr(WALK, n)[:3] for n in ("root_pos", "root_quat", "joint_pos", "key_pos")})
    (window,) = motion_windows(clip, 10.0, 8.0)
    assert window.shape == (1, len(COLUMNS)) and np.isfinite(window).all()


def test_normaliser_centres_and_has_a_floor() -> None:
    windows = motion_windows(WALK, 10.0, 8.0)
    normaliser = fit_normaliser(windows)
    scaled = (windows[0] - normaliser.mean) / normaliser.std
    np.testing.assert_allclose(scaled.mean(0), 0.0, atol=1e-3)
    assert normaliser.std[COLUMNS.index("p.pelvis.x")] == pytest.approx(0.02)
    assert scaled.std(0).max() < 1.001


def test_pad_marks_what_is_real() -> None:
    values, mask = pad([np.ones((2, 3)), np.ones((4, 3))], length=5)
    assert values.shape == (2, 5, 3) and mask.sum(1).tolist() == [2, 4]
    assert (values.sum(2) == 3 * mask).all()


def test_heading_of_a_turn() -> None:
    for angle in (-3.0, -0.5, 0.0, 1.0, 3.0):
        assert heading(np.array([np.cos(angle / 2), 0, 0, np.sin(angle / 2)])) == pytest.approx(angle)
