"""Windows of a flight started again from noisy readings, with and without its effects, and what noise makes of them.

Errors of windows are (W, E): at each compared tick the tangent from the simulated to the read position (nv,) and the
difference of velocities (nv,), readings themselves without noise.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import mujoco
import numpy as np
from mujoco.batch import Batch
from scipy.linalg import hadamard

from benchmarks.undeclared.excite import HZ
from benchmarks.undeclared.flight import NOISE, Flight
from benchmarks.undeclared.resume import resumed
from bumblebee.stand_in.undeclared.declared import Declared
from bumblebee.stand_in.undeclared.law import Law, Seen
from bumblebee.stand_in.undeclared.simulation import TrueRobots

HORIZON, TICKS = 5, (2, 5)  # control periods
_FIRST = 10  # ticks before the first window
_BENT = 0.5  # share of the variance that is not linear in the starts, added to each value's own


@dataclass(frozen=True, eq=False)
class Windows:
    """W windows of one flight, on the robot `robot` read with `noise` times its sensors' noise."""

    robot: Declared
    model: mujoco.MjModel
    noise: float
    flight: Flight
    picks: np.ndarray
    """(W, 2) robot and first tick."""

    def part(self, keep: np.ndarray) -> "Windows":
        """Some of them."""
        return Windows(self.robot, self.model, self.noise, self.flight, self.picks[keep])

    @property
    def qpos(self) -> np.ndarray:
        """(W, nq) read at the start, without noise."""
        return self.flight.qpos[self.picks[:, 1], self.picks[:, 0]]

    @property
    def qvel(self) -> np.ndarray:
        """(W, nv)."""
        return self.flight.qvel[self.picks[:, 1], self.picks[:, 0]]

    @cached_property
    def target(self) -> np.ndarray:
        """(W, ticks, J)."""
        return self._during(self.flight.target)

    @cached_property
    def after(self) -> list[np.ndarray]:
        """Read positions and velocities (W, nq + nv) at the compared ticks."""
        r, k = self.picks.T
        return [np.concatenate((self.flight.qpos[k + h, r], self.flight.qvel[k + h, r]), axis=1) for h in TICKS]

    @cached_property
    def sigma(self) -> np.ndarray:
        """(2 nv,) noise of positions and velocities."""
        joints = len(self.robot.joints)
        q, v = np.full(joints, NOISE["q"]), np.full(joints, NOISE["v"])
        if self.robot.floating:
            q = np.concatenate((np.full(3, NOISE["place"]), np.full(3, NOISE["quat"]), q))
            v = np.concatenate((np.full(3, NOISE["odometry"]), np.full(3, NOISE["gyro"]), v))
        return self.noise * np.concatenate((q, v))

    @property
    def guesses(self) -> bool:
        """Whether the effects remember what readings do not show."""
        return any(type(law).settle is not Law.settle for law in self.flight.laws[0])

    def starts(self, rng: np.random.Generator) -> np.ndarray:
        """(W, 2 nv) a draw of the starts' noise."""
        return self.sigma * rng.standard_normal((len(self.picks), 2 * self.model.nv))

    def read(self, rng: np.random.Generator) -> np.ndarray:
        """(W, E) a draw of the compared readings' noise."""
        return np.tile(self.sigma, len(TICKS)) * rng.standard_normal((len(self.picks), len(TICKS) * len(self.sigma)))

    def without(self, off: np.ndarray) -> np.ndarray:
        """Errors of the robot without effects, its starts off by (W, 2 nv)."""
        # The same steps as with the effect, of which they are no part.
        parts = max((law.parts for law in self.flight.laws[0]), default=1)
        robots = TrueRobots(self.robot, [], len(self.picks), np.random.default_rng(0), parts)
        robots.reset(*self._off(off), self.target[:, 0])
        return self._errors(robots, self.target)

    def known(self, off: np.ndarray, rng: np.random.Generator, guess: bool) -> np.ndarray:
        """Starts with the flight's effects; what no reading shows is as it was, or guessed from noisy readings."""
        robot, model, nv, joints = self.robot, self.model, self.model.nv, len(self.robot.joints)
        r, k = self.picks.T
        around = k + np.array([[-1], [0], [1]])
        q, v = self.flight.qpos[around, r][..., -joints:], self.flight.qvel[around, r][..., -joints:]
        off_q, off_v = (self.noise * NOISE[name] * rng.standard_normal(q.shape) for name in ("q", "v"))
        off_q[1], off_v[1] = off[:, nv - joints : nv], off[:, 2 * nv - joints :]
        torque = self.flight.torque[around, r] - robot.kp * off_q - robot.kd * off_v
        growth, acceleration = ((x[2] - x[0]) * HZ / 2 for x in (torque, v + off_v))
        seen = Seen(robot.joints, (q + off_q)[1], (v + off_v)[1], torque[1], growth, acceleration)

        def moved(own: mujoco.MjModel, qpos: np.ndarray, qvel: np.ndarray) -> None:
            rows = [own.joint(name).id for name in robot.joints]
            qpos[:, own.jnt_qposadr[rows]] += off_q[1]
            qvel[:, own.jnt_dofadr[rows]] += off_v[1]
            if robot.floating:
                base = np.tile(model.qpos0, (len(qpos), 1))
                base[:, :7] = qpos[:, :7]
                qpos[:, :7] = _integrated(model, base, off[:, :nv])[:, :7]
                qvel[:, :6] += off[:, nv : nv + 6]

        state = self.flight.own_qpos[k, r], self.flight.own_qvel[k, r]
        robots = resumed(robot, self.flight.laws, self.picks, state, seen, k / HZ, moved, guess)
        return self._errors(robots, self._during(self.flight.arrived))

    def declared(self, off: np.ndarray) -> np.ndarray:
        """Errors of the declared model at its own step and integrator."""
        qpos, qvel = self._off(off)
        batch = Batch(self.model, len(qpos), 1)
        batch.bind("qpos")[:], batch.bind("qvel")[:] = qpos, qvel
        rows = [self.model.actuator(name).id for name in self.robot.joints]
        control, steps = batch.bind("ctrl"), round(1 / HZ / self.model.opt.timestep)

        def hold(target: np.ndarray) -> None:
            control[:, rows] = target
            batch.step(nstep=steps)

        return self._compared(hold, lambda: (batch.bind("qpos"), batch.bind("qvel")), self.target)

    def roots(self, rng: np.random.Generator, more: np.ndarray | float = 0.0) -> np.ndarray:
        """(W, E, E) that whiten each window: start noise as the declared model passes it on, noise of readings, `more`.

        The starts' coordinates are moved together, by signs from a Hadamard matrix: where the model is linear the
        samples have the propagated covariance exactly. What is not linear has few samples; half of its variance is
        added to each value's own.
        """
        count, coordinates = len(self.picks), 2 * self.model.nv
        size = 1 << int(np.ceil(np.log2(coordinates + 1)))
        signs = hadamard(size)[:, 1 : coordinates + 1] * rng.choice([-1.0, 1.0], coordinates)
        every = self.part(np.repeat(np.arange(count), size))
        errors = every.declared(np.tile(signs, (count, 1)) * self.sigma).reshape(count, size, -1)
        read, out = np.tile(self.sigma**2, len(TICKS)), []
        for error in errors:
            error = error[np.isfinite(error).all(axis=1)]
            away = error - error.mean(axis=0) if len(error) else np.zeros((1, len(read)))
            noise = read.copy()
            if len(error) == size and size - 1 > coordinates:
                bent = away - signs @ (signs.T @ away) / size
                noise += _BENT * (bent**2).sum(axis=0) / (size - 1 - coordinates)
            out.append(np.linalg.inv(np.linalg.cholesky(away.T @ away / len(away) + np.diag(noise) + more)))
        return np.stack(out)

    def _during(self, table: np.ndarray) -> np.ndarray:
        """Rows of a table (T, R, J) in the windows, (W, ticks, J)."""
        r, k = self.picks.T
        return np.stack([table[k + h, r] for h in range(HORIZON)], axis=1)

    def _off(self, off: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        nv = self.model.nv
        return _integrated(self.model, self.qpos, off[:, :nv]), self.qvel + off[:, nv:]

    def _errors(self, robots: TrueRobots, arrived: np.ndarray) -> np.ndarray:
        return self._compared(robots.hold, robots.state, arrived)

    def _compared(self, hold: Callable, state: Callable, arrived: np.ndarray) -> np.ndarray:
        """Read minus simulated, (W, E); `arrived` (W, ticks, J) is what reaches the drives."""
        errors, nq = [], self.model.nq
        for tick in range(HORIZON):
            hold(arrived[:, tick])
            if tick + 1 in TICKS:
                q, v = state()
                wanted = self.after[TICKS.index(tick + 1)]
                errors.append(np.concatenate((_difference(self.model, q, wanted[:, :nq]), wanted[:, nq:] - v), axis=1))
        return np.concatenate(errors, axis=1)


def windows_of(robot: Declared, model: mujoco.MjModel, noise: float, flight: Flight, most: int) -> Windows:
    """At most `most` windows, spread over a flight before its falls."""
    every = [
        (r, k)
        for r in range(flight.qpos.shape[1])
        for k in range(_FIRST, int(min(flight.alive[r], len(flight.qpos))) - HORIZON - 1, HORIZON)
    ]
    if len(every) > most:
        every = [every[i] for i in np.linspace(0, len(every) - 1, most).round().astype(int)]
    return Windows(robot, model, noise, flight, np.array(every, dtype=int).reshape(-1, 2))


def _difference(model: mujoco.MjModel, one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Tangent from `one` to `other`, (W, nv)."""
    out = np.zeros((len(one), model.nv))
    for row in range(len(one)):
        if np.isfinite(one[row]).all():
            mujoco.mj_differentiatePos(model, out[row], 1.0, one[row], other[row])
        else:
            out[row] = np.nan
    return out


def _integrated(model: mujoco.MjModel, qpos: np.ndarray, tangent: np.ndarray) -> np.ndarray:
    out = qpos.copy()
    for row in range(len(out)):
        mujoco.mj_integratePos(model, out[row], tangent[row], 1.0)
    return out
