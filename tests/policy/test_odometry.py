"""The odometry of a robot without motion capture: exact but for what it states, smooth, and each episode's own."""

from dataclasses import replace

import numpy as np
import pytest

from bumblebee.motion.kinematics import sole_points
from bumblebee.policy.odometry import Odometry, OdometryErrors, placed
from bumblebee.robot.facts import stand_pose
from bumblebee.robot.sensors import NO_NOISE, Sensors

TICKS, PERIOD = 500, 0.02
EXACT = OdometryErrors(scale=0.0, heading=0.0)
UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])
HEIGHT = -sole_points(np.zeros((1, 3)), UPRIGHT[None], stand_pose()[None])[..., 2].min()


def readings(speed: np.ndarray, weight: float = 330.0) -> Sensors:
    """B robots upright in their stand, moving at speed (B, 3) [m/s], one foot loaded."""
    count = len(speed)
    force = np.zeros((count, 2, 3))
    force[:, 0, 2] = weight
    place, joints = np.full((count, 3), np.nan), np.tile(stand_pose(), (count, 1))
    still = np.zeros((count, 3))
    return Sensors(joints, 0 * joints, np.tile(UPRIGHT, (count, 1)), still, speed, place, 0 * joints, force)


def walked(odometry: Odometry, speed: np.ndarray, ticks: int = TICKS, weight: float = 330.0) -> np.ndarray:
    """(ticks, B, 3) places that robots at a steady speed believe in."""
    everyone = np.arange(len(speed))
    return np.stack([odometry.seen(everyone, readings(speed, weight)).base_pos.copy() for _ in range(ticks)])


def rngs(*seeds: int) -> list[np.random.Generator]:
    return [np.random.default_rng(seed) for seed in seeds]


def start(count: int) -> np.ndarray:
    return np.tile([1.0, 2.0, HEIGHT], (count, 1))


def test_without_errors_it_is_the_path_from_the_true_start() -> None:
    path = walked(Odometry(start(1), rngs(0), PERIOD, EXACT), np.array([[0.8, -0.3, 0.0]]))
    time = np.arange(TICKS)[:, None] * PERIOD
    assert path[:, 0] == pytest.approx(start(1) + time * [0.8, -0.3, 0.0], abs=1e-9)


def test_it_drifts_by_one_to_two_percent_of_the_distance() -> None:
    speed = np.tile([1.0, 0.0, 0.0], (200, 1))
    path = walked(Odometry(start(200), rngs(*range(200)), PERIOD), speed)
    error = np.linalg.norm((path[-1] - path[0])[:, :2] - [(TICKS - 1) * PERIOD, 0.0], axis=1)
    assert 0.01 < np.sqrt(np.mean(error**2)) / (TICKS * PERIOD) < 0.02
    assert path[..., 2] == pytest.approx(HEIGHT, abs=1e-6)


def test_a_robot_that_stands_wanders_by_the_noise_of_its_velocity_alone() -> None:
    """20 mm/s a tick, summed: 2.8 mm after a second, 9 mm after ten."""
    odometry, rng, everyone = Odometry(start(100), rngs(*range(100)), PERIOD), np.random.default_rng(0), np.arange(100)
    for _ in range(TICKS):
        last = odometry.seen(everyone, readings(rng.normal(0, 0.02, (100, 3)))).base_pos
    assert np.std(last[:, 0]) == pytest.approx(0.02 * PERIOD * np.sqrt(TICKS), rel=0.25)
    assert np.std(last[:, 2]) < 0.002  # the standing leg holds the height


def test_the_path_is_smooth() -> None:
    """No step beyond what noise of the velocity makes in 20 ms, where motion capture jumps by its own noise."""
    rng, odometry = np.random.default_rng(0), Odometry(start(1), rngs(3), PERIOD)
    path = [
        odometry.seen(np.array([0]), readings(rng.normal(0, 0.02, (1, 3)))).base_pos[0].copy() for _ in range(TICKS)
    ]
    assert np.abs(np.diff(path, axis=0)).max() < 0.002


def test_in_the_air_the_height_is_the_velocitys_and_comes_back_to_the_leg_on_landing() -> None:
    odometry = Odometry(start(1), rngs(0), PERIOD, EXACT)
    up = walked(odometry, np.array([[0.0, 0.0, 1.0]]), 11, weight=0.0)[-1, 0, 2]
    assert up == pytest.approx(HEIGHT + 0.2)
    assert walked(odometry, np.zeros((1, 3)), 100)[-1, 0, 2] == pytest.approx(HEIGHT, abs=1e-3)


def test_each_robot_has_its_own_errors_whatever_runs_beside_and_whoever_rests() -> None:
    speed = np.tile([1.0, 0.0, 0.0], (3, 1))
    alone = walked(Odometry(start(1), rngs(7), PERIOD), speed[:1], 20)
    among = Odometry(start(3), rngs(5, 7, 9), PERIOD)
    mixed = []
    for tick in range(30):
        some = np.array([0, 1, 2]) if tick % 3 else np.array([0, 2])
        seen = among.seen(some, readings(speed[some])).base_pos
        mixed += [seen[1]] if tick % 3 else []
    assert np.array_equal(np.array(mixed), alone[:, 0])
    everyone = walked(Odometry(start(3), rngs(5, 7, 9), PERIOD), speed, 50)[-1]
    assert len({float(x) for x in everyone[:, 0]}) == 3


def test_motion_capture_leaves_the_place_as_it_is() -> None:
    true = replace(readings(np.zeros((1, 3))), base_pos=start(1))
    assert placed(NO_NOISE, start(1), rngs(0), PERIOD)(np.array([0]), true) is true
