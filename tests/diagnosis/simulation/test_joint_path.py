"""A joint's path without the noise of its readings, and what remembers it."""

import numpy as np
import pytest

from bumblebee.diagnosis.simulation.joint_path import joint_path, white_noise
from bumblebee.diagnosis.thresholds.simulation import JointPath
from bumblebee.measured.rollout import Rollout
from bumblebee.sim.effects import bent

NOISE = 5e-4, 0.02  # rad, rad/s


def rollout(time: np.ndarray, place: np.ndarray, speed: np.ndarray) -> Rollout:
    columns = {"joint_pos": place[:, None], "joint_vel": speed[:, None], "joint_target": place[:, None]}
    return Rollout("r00", ("j",), 50.0, time, **columns)


def mostly_at_rest(count: int = 300, seed: int = 0) -> tuple[np.ndarray, ...]:
    """Times, positions, velocities: a fast start of 40 mrad and back, then a slow sway of 2 mrad."""
    time = 0.02 * np.arange(count) + 0.002 * np.random.default_rng(seed).random(count)
    turn = 2 * np.pi / 0.3
    fast = time < 0.3
    place = np.where(fast, 0.02 * (1 - np.cos(turn * time)), 0.0) + 0.002 * np.sin(2.0 * time)
    speed = np.where(fast, 0.02 * turn * np.sin(turn * time), 0.0) + 0.004 * np.cos(2.0 * time)
    return time, place, speed


def dahl(path: np.ndarray, width: float = 0.05) -> np.ndarray:
    z = np.zeros((len(path), 1))
    for k, move in enumerate(np.diff(path)):
        z[k + 1] = bent(z[k], np.array([move]), width)
    return z[:, 0]


@pytest.mark.parametrize("seed", range(3))
def test_what_remembers_the_path_is_neither_wound_back_by_noise_nor_blind_to_short_motion(seed: int) -> None:
    time, place, speed = mostly_at_rest(seed=seed)
    rng = np.random.default_rng(seed)
    noisy = place + NOISE[0] * rng.standard_normal(len(time)), speed + NOISE[1] * rng.standard_normal(len(time))
    found = joint_path(rollout(time, *noisy), 0, JointPath())
    mean = np.convolve(noisy[0], np.ones(7) / 7, mode="same")
    truth = dahl(place)
    error = [float(np.sqrt(((dahl(path) - truth) ** 2).mean())) for path in (found, noisy[0], mean)]
    assert error[0] < 0.5 * min(error[1:])
    assert np.sqrt(((found - place) ** 2).mean()) < 0.8 * NOISE[0]


def test_readings_without_noise_are_left_as_they_are() -> None:
    time, place, speed = mostly_at_rest()
    assert joint_path(rollout(time, place, speed), 0, JointPath()) == pytest.approx(place, abs=2e-4)


def test_a_joint_that_stands_and_a_log_of_few_rows_are_no_error() -> None:
    time = 0.02 * np.arange(100)
    still = rollout(time, np.full(100, 0.3), np.zeros(100))
    assert joint_path(still, 0, JointPath()) == pytest.approx(np.full(100, 0.3), abs=1e-6)
    few = rollout(time[:5], time[:5], np.ones(5))
    assert np.array_equal(joint_path(few, 0, JointPath()), time[:5])


def test_white_noise_is_told_from_a_smooth_motion() -> None:
    _, place, speed = mostly_at_rest(2000)
    read = np.stack((place, speed), axis=1) + np.array(NOISE) * np.random.default_rng(0).standard_normal((2000, 2))
    assert white_noise(read) == pytest.approx(np.array(NOISE), rel=0.1)


def test_a_joint_that_rests_under_coarse_readings_is_no_error() -> None:
    """Positions that flicker and velocities of zero: the least intensities are too far below for floating point."""
    time = 0.05 * np.arange(60)
    place = 0.3 + 0.01 * np.random.default_rng(0).integers(0, 2, 60)
    path = joint_path(rollout(time, place, np.zeros(60)), 0, JointPath())
    assert np.isfinite(path).all() and path.min() >= 0.3 - 1e-9 and path.max() <= 0.31 + 1e-9
