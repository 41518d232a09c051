"""Let true robots follow a plan, and write down what their sensors say."""

from collections.abc import Sequence
from copy import deepcopy
from dataclasses import dataclass

import numpy as np

from benchmarks.undeclared.excite import HZ, Plan, fallen
from bumblebee.measured.rollout import Rollout
from bumblebee.stand_in.undeclared.declared import Declared
from bumblebee.stand_in.undeclared.law import Law
from bumblebee.stand_in.undeclared.simulation import TrueRobots

# Standard deviations of the sensors' white noise: rad, rad/s, rad, rad/s, m/s, m.
NOISE = {"q": 5e-4, "v": 0.02, "quat": 0.002, "gyro": 0.01, "odometry": 0.02, "place": 0.001}
_BEFORE_FALL = 10  # ticks that are cut off before a fall


@dataclass(frozen=True, eq=False)
class Flight:
    """Motion of R robots in T ticks, without noise."""

    qpos: np.ndarray
    """(T, R, nq) as faultless sensors behind this robot's own faults say."""
    qvel: np.ndarray
    """(T, R, nv)."""
    target: np.ndarray
    """(T, R, J) [rad]."""
    torque: np.ndarray
    """(T, R, J) [N m]."""
    alive: np.ndarray
    """(R,) ticks before the fall."""
    arrived: np.ndarray
    """(T, R, J) what became of the targets when they were issued."""
    own_qpos: np.ndarray
    """(T, R, nq') the true model's own states."""
    own_qvel: np.ndarray
    """(T, R, nv')."""
    laws: tuple[tuple[Law, ...], ...]
    """The laws with what they remember at every tick."""


def fly(robot: Declared, laws: Sequence[Law], plan: Plan, rng: np.random.Generator) -> Flight:
    """Run the plan on robots with `laws`."""
    robots = TrueRobots(robot, laws, len(plan.qpos), rng)
    qpos, qvel = plan.qpos, plan.qvel
    target = plan.target(0, qpos, qvel)
    robots.reset(qpos, qvel, target)
    rows: list[tuple[np.ndarray, ...]] = []
    moments: list[tuple[Law, ...]] = []
    alive = np.full(len(qpos), plan.ticks)
    for tick in range(plan.ticks):
        qpos, qvel = robots.state()
        bad = ~np.isfinite(qvel).all(axis=1) | (np.abs(qvel) > 200).any(axis=1)
        if robot.floating:
            bad |= fallen(qpos)
        alive = np.where(bad, np.minimum(alive, max(tick - _BEFORE_FALL, 0)), alive)
        if bad.all():
            break
        target = plan.target(tick, qpos, qvel)
        moments.append(tuple(deepcopy(robots.laws)))
        own, torque = robots.own_state(), robots.torque.copy()
        arrived = robots.arrived(target)
        rows.append((qpos, qvel, target, torque, arrived, *own))
        robots.hold(arrived)
    qpos, qvel, target, torque, *more = (np.stack(part) for part in zip(*rows, strict=True))
    return Flight(qpos, qvel, target, torque, alive, *more, tuple(moments))


def rollouts(robot: Declared, flight: Flight, noise: float, rng: np.random.Generator, prefix: str) -> list[Rollout]:
    """The flight as a logger writes it, with `noise` times the sensors' noise; robots that fell soon are left out."""
    found = []
    for r in range(flight.qpos.shape[1]):
        ticks = int(min(flight.alive[r], len(flight.qpos)))
        if ticks < 60:
            continue
        qpos, qvel = flight.qpos[:ticks, r], flight.qvel[:ticks, r]
        joints = len(robot.joints)
        columns = {
            "joint_pos": qpos[:, -joints:] + noise * NOISE["q"] * rng.standard_normal((ticks, joints)),
            "joint_vel": qvel[:, -joints:] + noise * NOISE["v"] * rng.standard_normal((ticks, joints)),
            "joint_target": flight.target[:ticks, r],
        }
        if robot.floating:
            columns |= _base_columns(qpos, qvel, noise, rng)
        time = np.arange(ticks) / HZ + 2.0
        meta = {"robot": robot.name, "kp": robot.kp.tolist(), "kd": robot.kd.tolist()}
        found.append(Rollout(f"{prefix}{r:02d}", robot.joints, HZ, time, meta=meta, **columns))
    return found


def _base_columns(qpos: np.ndarray, qvel: np.ndarray, noise: float, rng: np.random.Generator) -> dict[str, np.ndarray]:
    ticks = len(qpos)
    draw = lambda name: noise * NOISE[name] * rng.standard_normal((ticks, 3))  # noqa: E731
    small = np.concatenate((np.ones((ticks, 1)), draw("quat") / 2), axis=1)
    quat = _product(qpos[:, 3:7], small / np.linalg.norm(small, axis=1, keepdims=True))
    return {
        "base_pos": qpos[:, :3] + draw("place"),
        "base_quat": quat,
        "base_ang_vel": qvel[:, 3:6] + draw("gyro"),
        "base_lin_vel": _into(qpos[:, 3:7], qvel[:, :3]) + draw("odometry"),
    }


def _product(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Hamilton product of wxyz quaternions (T, 4)."""
    scalar = p[:, :1] * q[:, :1] - (p[:, 1:] * q[:, 1:]).sum(axis=1, keepdims=True)
    vector = p[:, :1] * q[:, 1:] + q[:, :1] * p[:, 1:] + np.cross(p[:, 1:], q[:, 1:])
    return np.concatenate((scalar, vector), axis=1)


def _into(quat: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """World vectors (T, 3) in the frames of wxyz quaternions (T, 4)."""
    axis = -quat[:, 1:]
    cross = 2 * np.cross(axis, vector)
    return vector + quat[:, :1] * cross + np.cross(axis, cross)
