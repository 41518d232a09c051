"""Readings between ticks: late joints on cubics, the square of a torque that a step of the command makes."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from bumblebee.diagnosis.dataset.session import Session, make_session
from bumblebee.diagnosis.simulation.starts.actuator_history import mean_squares, plant_servos, read_at
from bumblebee.diagnosis.simulation.windows import choose_starts, cut
from tests.diagnosis import arm


@pytest.fixture(scope="module")
def session() -> Session:
    return make_session(mujoco.MjSpec.from_string(arm.XML), arm.simulate({}, count=2, seconds=2.0), "arm", "memory")


def test_a_late_joint_is_where_the_cubic_through_its_readings_puts_it(session: Session) -> None:
    first = session.rollouts[0]
    place, speed = (lambda t: np.stack([t**3 - t, 2 * t**2, 1 + t], axis=-1)), (
        lambda t: np.stack([3 * t**2 - 1, 4 * t, np.ones_like(t)], axis=-1)
    )  # fmt: skip
    moved = replace(first, joint_pos=place(first.time), joint_vel=speed(first.time))
    windows = cut(session.plant, session.layout, [moved], choose_starts([moved], [0], 0.2, 6))
    delay = np.array([0.004, 0.013, 0.031])
    q, v = read_at(windows, 0.002, delay, range(3), session.plant.thresholds.path)
    at = first.time[windows.start]
    for j in range(3):
        assert q[:, j] == pytest.approx(place(at + 0.002 + delay[j])[:, j], abs=1e-7)
        assert v[:, j] == pytest.approx(speed(at + 0.002 + delay[j])[:, j], abs=3e-4)  # on a line between ticks


def test_a_late_joint_at_rest_starts_no_nearer_to_the_readings_after_it(session: Session) -> None:
    """Half of a tick later lies the mean of two readings, with half of the noise, which no encoder's age made."""
    first, rng = session.rollouts[0], np.random.default_rng(4)
    place, speed = 0.002 * rng.standard_normal(first.joint_pos.shape), 0.05 * rng.standard_normal(first.joint_pos.shape)
    noisy = replace(first, joint_pos=place, joint_vel=speed)
    windows = cut(session.plant, session.layout, [noisy], choose_starts([noisy], [0], 0.05, 12))
    rule, half = session.plant.thresholds.path, 0.5 * float(np.median(np.diff(first.time)))
    (q, v), (q_read, v_read) = (read_at(windows, 0.0, np.full(3, late), range(3), rule) for late in (half, 0.0))
    assert np.std(v - v_read) < 0.1 * 0.05
    assert np.std(q - q_read) < 0.1 * 0.002


def test_squares_of_torques_between_ticks_are_those_of_the_course_between_them(session: Session) -> None:
    """A joint that follows steps of its command, critically damped: the ends alone say too much."""
    first, servos = session.rollouts[0], plant_servos(session.plant)
    rate, ticks = 40.0, len(first.time)
    target = 0.02 * np.where(np.arange(ticks)[:, None] % 2, 1.0, -1.0) * np.ones(3)
    place, speed = np.zeros((ticks, 3)), np.zeros((ticks, 3))

    def course(k: int, after: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Positions and speeds (N, 3) at times `after` (N, 1) [s] since tick k."""
        away = place[k] - target[k]
        slope, fades = speed[k] + rate * away, np.exp(-rate * after)
        return target[k] + (away + slope * after) * fades, (slope - rate * (away + slope * after)) * fades

    for k in range(ticks - 1):
        ends = course(k, np.diff(first.time)[k : k + 1, None])
        place[k + 1], speed[k + 1] = (x[0] for x in ends)
    moved = replace(first, joint_target=target, joint_pos=place, joint_vel=speed)
    squares = servos.torque(*course(10, np.linspace(0.0, 0.02, 201)[:, None]), target[10]) ** 2
    assert mean_squares(session.plant, moved)[10] == pytest.approx(squares.mean(axis=0), rel=0.05)
    assert (0.5 * (squares[0] + squares[-1]) > 1.1 * squares.mean(axis=0)).all()
