"""How small an effect can be and still be seen: its minimal detectable size in given data.

Windows of 0.1 s of the true robot's noise-free readings are compared with two robots, restarted from the same readings
and given the same commands: one without the effect and one with it, at its true size. The second, too, starts from
readings: what its effect remembers of commands and readings is known, but what none of them shows (on which side play
touches, how far a shaft is twisted, how a mount leans) it guesses from noisy ones (`truth.resume`). Both differences
are whitened by the covariance that sensor noise leaves in such a comparison, starts included (noisy restarts of the
robot without effects, pooled over windows). What the declared model at 5 ms does otherwise than the same robot at 1 ms
is taken out of both, joint by joint, with a free amplitude: an effect that looks like another integrator cannot be told
from it.

By how much the summed square falls when the effect is put in is the chi-square of the best test of this one effect that
starts from readings; the minimal detectable size is where it is 25: five standard errors, enough to be seen four times
in five by a test that shares a false-alarm rate of 0.5 % among some hundred candidates. Up to version 3 of the suite it
was the whole square without the effect, which counts as seen what not even the true law explains.
"""

from collections.abc import Callable
from dataclasses import dataclass

import mujoco
import numpy as np
from mujoco.batch import Batch

from benchmarks.undeclared.excite import HZ
from benchmarks.undeclared.flight import NOISE, Flight
from benchmarks.undeclared.robots import Declared
from benchmarks.undeclared.truth.law import Seen
from benchmarks.undeclared.truth.resume import resumed
from benchmarks.undeclared.truth.simulation import TrueRobots

CHI2 = 25.0
_HORIZON, _TICKS = 5, (2, 5)  # control periods
_COVARIANCE_WINDOWS, _STARTS, _MOST_WINDOWS = 16, 40, 160


@dataclass(frozen=True, eq=False)
class Eye:
    """What sensor noise leaves of a restarted comparison on one robot."""

    robot: Declared
    model: mujoco.MjModel
    noise: float
    root: np.ndarray
    """(E, E): whitens the differences."""


def make_eye(robot: Declared, null: Flight, noise: float, rng: np.random.Generator) -> Eye:
    """From the motion of the robot without effects."""
    model = robot.spec.compile()
    picks = _windows(null, _COVARIANCE_WINDOWS)
    qpos, qvel, target, after = _gather(null, picks)
    qpos, qvel, target = (np.repeat(x, _STARTS, axis=0) for x in (qpos, qvel, target))
    sigma = noise * _sigma(robot, model)
    nv = model.nv
    draws = sigma * rng.standard_normal((len(qpos), 2 * nv))
    started = _moved(model, qpos, draws[:, :nv])
    twin = _without(robot, started, qvel + draws[:, nv:], target)
    error = _compare(model, twin, target, [np.repeat(a, _STARTS, axis=0) for a in after])
    error = error + np.tile(sigma, len(_TICKS)) * rng.standard_normal(error.shape)
    error = error[np.isfinite(error).all(axis=1)]
    covariance = error.T @ error / len(error)
    covariance = 0.9 * covariance + 0.1 * np.diag(np.diag(covariance))
    return Eye(robot, model, noise, np.linalg.inv(np.linalg.cholesky(covariance)))


def chi_square(eye: Eye, flight: Flight) -> float:
    """By how much a flight's whitened square falls if its effects are in the model, for all its ticks."""
    picks = _windows(flight, _MOST_WINDOWS)
    if not len(picks):
        return np.inf
    qpos, qvel, target, after = _gather(flight, picks)
    arrived = np.stack([flight.arrived[picks[:, 1] + h, picks[:, 0]] for h in range(_HORIZON)], axis=1)
    # The same steps as with the effect, of which they are no part.
    parts = max((law.parts for law in flight.laws[0]), default=1)
    without = _compare(eye.model, _without(eye.robot, qpos, qvel, target, parts), target, after)
    known = _compare(eye.model, _with(eye, flight, picks), arrived, after)
    numeric = without - _compare_declared(eye.model, eye.robot, qpos, qvel, target, after)
    good = np.isfinite(without).all(axis=1) & np.isfinite(known).all(axis=1) & np.isfinite(numeric).all(axis=1)
    basis = []
    for rows in _groups(eye):
        part = np.zeros_like(numeric[good])
        part[:, rows] = numeric[good][:, rows]
        basis.append((part @ eye.root.T).ravel())
    span = np.linalg.svd(np.array(basis), full_matrices=False)[2]
    gain = _left(span, without[good] @ eye.root.T) - _left(span, known[good] @ eye.root.T)
    total = int(np.minimum(flight.alive, len(flight.qpos)).sum()) / _HORIZON
    return max(gain, 0.0) * total / max(good.sum(), 1)


def _left(span: np.ndarray, white: np.ndarray) -> float:
    """Square of a whitened difference (W, E) outside the rows of `span`."""
    flat = white.ravel()
    return float(flat @ flat - ((span @ flat) ** 2).sum())


def minimal_size(
    eye: Eye, run: Callable[[float], Flight], first: float, most: float, least: float = 0.0, tries: int = 7
) -> float:
    """Size at which chi-square is `CHI2`: infinite if `most` is not seen, by its square law if `least` is."""
    size, low, high = min(first, most), None, None
    tried: list[tuple[float, float]] = []
    for _ in range(tries):
        value = max(chi_square(eye, run(size)), 1e-3)
        if size <= least or 0.5 * CHI2 < value < 2 * CHI2:
            return float(size * np.sqrt(CHI2 / value))
        if value < CHI2:
            low = size if low is None else max(low, size)
            if size >= most:
                return np.inf
        else:
            high = size if high is None else min(high, size)
        tried.append((size, value))
        size = max(_next(tried, low, high, most), least)
    return float(np.sqrt((low or high) * (high or low)))


def _next(tried: list[tuple[float, float]], low: float | None, high: float | None, most: float) -> float:
    """The next size to try: by the power law through the last two, inside what is known."""
    (size, value), power = tried[-1], 2.0
    if len(tried) > 1 and tried[-2][0] != size:
        slope = np.log(value / tried[-2][1]) / np.log(size / tried[-2][0])
        power = float(np.clip(slope, 0.7, 8.0)) if np.isfinite(slope) else 2.0
    wanted = size * float(np.clip((CHI2 / value) ** (1 / power), 0.02, 20.0))
    if low is not None and high is not None:
        reach = (high / low) ** 0.2
        wanted = float(np.clip(wanted, low * reach, high / reach))
    return min(wanted, most)


def _sigma(robot: Declared, model: mujoco.MjModel) -> np.ndarray:
    """(2 nv,) noise of positions and velocities at noise 1."""
    joints = len(robot.joints)
    q, v = np.full(joints, NOISE["q"]), np.full(joints, NOISE["v"])
    if robot.floating:
        q = np.concatenate((np.full(3, NOISE["place"]), np.full(3, NOISE["quat"]), q))
        v = np.concatenate((np.full(3, NOISE["odometry"]), np.full(3, NOISE["gyro"]), v))
    return np.concatenate((q, v))


def _windows(flight: Flight, most: int) -> np.ndarray:
    """(W, 2) robot and first tick."""
    every = [
        (r, k)
        for r in range(flight.qpos.shape[1])
        for k in range(10, int(min(flight.alive[r], len(flight.qpos))) - _HORIZON - 1, _HORIZON)
    ]
    if len(every) > most:
        every = [every[i] for i in np.linspace(0, len(every) - 1, most).round().astype(int)]
    return np.array(every, dtype=int).reshape(-1, 2)


def _gather(flight: Flight, picks: np.ndarray) -> tuple:
    r, k = picks.T
    target = np.stack([flight.target[k + h, r] for h in range(_HORIZON)])
    after = [np.concatenate((flight.qpos[k + h, r], flight.qvel[k + h, r]), axis=1) for h in _TICKS]
    return flight.qpos[k, r], flight.qvel[k, r], np.moveaxis(target, 0, 1), after


def _groups(eye: Eye) -> list[list[int]]:
    """Columns of the comparison that belong to one joint, and those of the base."""
    nv, ticks = eye.model.nv, 2 * len(_TICKS)
    joints = len(eye.robot.joints)
    groups = [[part * nv + dof for part in range(ticks)] for dof in range(nv - joints, nv)]
    if eye.robot.floating:
        groups.append([part * nv + dof for part in range(ticks) for dof in range(6)])
    return groups


def _without(robot: Declared, qpos: np.ndarray, qvel: np.ndarray, target: np.ndarray, parts: int = 1) -> TrueRobots:
    """Robots without effects at the readings."""
    twin = TrueRobots(robot, [], len(qpos), np.random.default_rng(0), parts)
    twin.reset(qpos, qvel, target[:, 0])
    return twin


def _with(eye: Eye, flight: Flight, picks: np.ndarray) -> TrueRobots:
    """Robots with the flight's effects at its readings; what they guess has the readings' noise."""
    robot, joints = eye.robot, len(eye.robot.joints)
    r, k = picks.T
    around, rng = k + np.array([[-1], [0], [1]]), np.random.default_rng(0)
    q, v = flight.qpos[around, r][..., -joints:], flight.qvel[around, r][..., -joints:]
    off_q, off_v = (eye.noise * NOISE[name] * rng.standard_normal(q.shape) for name in ("q", "v"))
    torque = flight.torque[around, r] - robot.kp * off_q - robot.kd * off_v
    growth, acceleration = ((x[2] - x[0]) * HZ / 2 for x in (torque, v + off_v))
    seen = Seen(robot.joints, q[1], v[1], torque[1], growth, acceleration)
    return resumed(robot, flight.laws, picks, (flight.own_qpos[k, r], flight.own_qvel[k, r]), seen, k / HZ)


def _compare(model: mujoco.MjModel, twin: TrueRobots, arrived: np.ndarray, after: list) -> np.ndarray:
    """Read minus restarted, (W, E); `arrived` (W, ticks, J) is what reaches the drives."""
    errors = []
    for tick in range(_HORIZON):
        twin.hold(arrived[:, tick])
        if tick + 1 in _TICKS:
            q, v = twin.state()
            wanted = after[_TICKS.index(tick + 1)]
            errors.append(
                np.concatenate((_difference(model, q, wanted[:, : model.nq]), wanted[:, model.nq :] - v), axis=1)
            )
    return np.concatenate(errors, axis=1)


def _compare_declared(
    model: mujoco.MjModel, robot: Declared, qpos: np.ndarray, qvel: np.ndarray, target: np.ndarray, after: list
) -> np.ndarray:
    """Read minus the declared model at its own step and integrator, (W, E)."""
    batch = Batch(model, len(qpos), 1)
    batch.bind("qpos")[:], batch.bind("qvel")[:] = qpos, qvel
    rows = [model.actuator(name).id for name in robot.joints]
    control, steps = batch.bind("ctrl"), round(1 / HZ / model.opt.timestep)
    errors = []
    for tick in range(_HORIZON):
        control[:, rows] = target[:, tick]
        batch.step(nstep=steps)
        if tick + 1 in _TICKS:
            wanted = after[_TICKS.index(tick + 1)]
            q, v = batch.bind("qpos"), batch.bind("qvel")
            errors.append(
                np.concatenate((_difference(model, q, wanted[:, : model.nq]), wanted[:, model.nq :] - v), axis=1)
            )
    return np.concatenate(errors, axis=1)


def _difference(model: mujoco.MjModel, one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Tangent from `one` to `other`, (W, nv)."""
    out = np.zeros((len(one), model.nv))
    for row in range(len(one)):
        if np.isfinite(one[row]).all():
            mujoco.mj_differentiatePos(model, out[row], 1.0, one[row], other[row])
        else:
            out[row] = np.nan
    return out


def _moved(model: mujoco.MjModel, qpos: np.ndarray, tangent: np.ndarray) -> np.ndarray:
    out = qpos.copy()
    for row in range(len(out)):
        mujoco.mj_integratePos(model, out[row], tangent[row], 1.0)
    return out
