"""Fast logs are smoothed, and what noise is left in them is true, of quantised readings, too."""

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
