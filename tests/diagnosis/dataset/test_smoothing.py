"""Fast logs: smoothed where a joint moves as a cubic does, left as read where it does not; the noise left is true."""

import numpy as np

from bumblebee.diagnosis.dataset.smoothing import smooth_rollouts
from bumblebee.diagnosis.simulation import Layout
from bumblebee.diagnosis.thresholds.dataset import Smoothing
from bumblebee.measured.rollout import Rollout

HZ, RULE = 500.0, Smoothing()
LAYOUT = Layout({"joint_pos": slice(0, 1), "joint_vel": slice(1, 2)}, 2)
TIME = np.arange(0.0, 4.0, 1 / HZ)


def log(place: np.ndarray, speed: np.ndarray) -> Rollout:
    """One joint's readings (T,)."""
    return Rollout("r", ("j",), HZ, TIME, place[:, None], speed[:, None], joint_torque_cmd=0 * place[:, None])


def sine(turn: float = 6.0) -> tuple[np.ndarray, np.ndarray]:
    return 0.3 * np.sin(turn * TIME), 0.3 * turn * np.cos(turn * TIME)


def test_white_noise_is_smoothed_to_what_is_said_to_be_left_of_it() -> None:
    (place, speed), sigma, rng = sine(), np.array([1e-3, 0.05]), np.random.default_rng(0)
    read = log(place + sigma[0] * rng.standard_normal(len(TIME)), speed + sigma[1] * rng.standard_normal(len(TIME)))
    (smooth,), left, count = smooth_rollouts([read], LAYOUT, sigma, RULE)
    apart = (smooth.joint_pos[:, 0] - place).std(), (smooth.joint_vel[:, 0] - speed).std()
    assert count == 1
    np.testing.assert_allclose(apart, left, rtol=0.15)
    assert (left < 0.5 * sigma).all()


def test_readings_within_one_step_of_an_encoder_are_not_made_better_by_their_mean() -> None:
    """A joint that creeps stays within a step for many ticks, which all have the same error."""
    step = 2e-3
    place, speed = 0.02 * np.sin(TIME), 0.02 * np.cos(TIME)
    read = log(np.round(place / step) * step, speed + 1e-2 * np.random.default_rng(0).standard_normal(len(TIME)))
    sigma = np.array([step / np.sqrt(12), 1e-2])
    (smooth,), left, _ = smooth_rollouts([read], LAYOUT, sigma, RULE)
    assert (smooth.joint_pos[:, 0] - place).std() < 1.2 * left[0]
    assert left[0] > 0.6 * sigma[0] and left[1] < 0.5 * sigma[1]


def test_a_joint_whose_velocities_are_not_the_slopes_of_its_positions_stays_as_read() -> None:
    """A servo that answers each command within the period is slower at the ticks than between them."""
    (place, speed), sigma = sine(), np.array([1e-6, 1e-4])
    read = log(place, 0.99 * speed)
    (same,), left, count = smooth_rollouts([read], LAYOUT, sigma, RULE)
    assert count == 0 and np.array_equal(left, sigma)
    assert np.array_equal(same.joint_vel, read.joint_vel)


def test_ticks_beside_an_impact_stay_as_read() -> None:
    sigma, rng = np.array([1e-5, 1e-3]), np.random.default_rng(0)
    speed = np.where(TIME < 2.0, 1.0, -1.0)
    place = 2.0 - np.abs(TIME - 2.0)
    noisy = place + sigma[0] * rng.standard_normal(len(TIME)), speed + sigma[1] * rng.standard_normal(len(TIME))
    (smooth,), _, count = smooth_rollouts([log(*noisy)], LAYOUT, sigma, RULE)
    near = np.abs(TIME - 2.0) < 0.008
    assert count == 1
    assert np.array_equal(smooth.joint_vel[near, 0], noisy[1][near])
    assert np.abs(smooth.joint_vel[~near, 0] - speed[~near]).max() < 0.01
