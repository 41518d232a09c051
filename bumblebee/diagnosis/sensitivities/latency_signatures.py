"""First-order columns of drives that lag and of encoders that are late, from torque answers and starts' slopes.

A lag is a torque: what the filter gives less what was asked for. A late encoder is three things. The servo acts on an
old reading, which is a torque; the joint is at a window's start not where it was read but where it went since, which is
a start that moved; and what is logged is as old, which is a change of the readings alone.
"""

from dataclasses import replace

import numpy as np

from bumblebee.diagnosis.residuals import Problem
from bumblebee.diagnosis.sensitivities.impulse_responses import Path
from bumblebee.diagnosis.simulation import Plant, Windows, at_starts, at_ticks, lagged, read_at
from bumblebee.sim.servo import Servos


class Late:
    """Torques and readings of the W windows' J joints along simulated paths of K steps."""

    def __init__(self, plant: Plant, windows: Windows, path: Path, servos: Servos) -> None:
        self._plant, self._windows, self._path, self._servos = plant, windows, path, servos
        self._q, self._v = path.qpos[..., plant.qpos], path.qvel[..., plant.dof]
        self._known: dict[tuple[str, float], np.ndarray] = {}

    def torque(self, kind: str, size: float, now: np.ndarray) -> np.ndarray:
        """Torque missing in the servos' `now` (W, K, J) [N m] where all drives lag or read late by `size` [s]."""
        if (kind, size) not in self._known:
            make = self._filtered if kind == "torque_lag" else self._old
            self._known[kind, size] = make(size, now) - now
        return self._known[kind, size]

    def readings(self, problem: Problem, delay: float, j: int) -> np.ndarray:
        """Whitened change (W, M) of the prediction for a late encoder of joint j, beside that of its servo's torque."""
        change = np.zeros(self._windows.measured.shape)
        out = np.zeros_like(problem.whitener.offset)
        parts = ((self._q[..., j], "joint_pos"), (self._v[..., j], "joint_vel"))
        for (path, name), ahead in zip(parts, self._start(delay), strict=True):
            column = problem.layout.slices[name].start + j
            change[..., column] = self._read_late(path, delay)
            # Slopes are of the residual, which falls where the prediction rises.
            out -= (ahead[:, j] / problem.sigma[column])[:, None] * problem.whitener.slopes[:, column]
        return out + problem.whitener(change, centre=False)

    def _lag(self, time: float) -> np.ndarray:
        """State (W, J) of all drives' lags at the starts."""
        every = list(range(self._q.shape[-1]))
        return at_starts(self._windows, lambda r: lagged(self._plant, r, every, np.full(len(every), time)))

    def _filtered(self, time: float, now: np.ndarray) -> np.ndarray:
        """Mean over each step of a first-order lag of `now`, which is held over the steps."""
        state = self._lag(time)
        keep = np.exp(-self._path.step / time)
        share, out = (1.0 - keep) * time / self._path.step, np.empty_like(now)
        for k in range(now.shape[1]):
            out[:, k] = now[:, k] + share * (state - now[:, k])
            state = now[:, k] + keep * (state - now[:, k])
        return out

    def _old(self, delay: float, now: np.ndarray) -> np.ndarray:
        """Torques from readings that are `delay` [s] old; before the start they are carried on backwards."""
        step, count = self._path.step, now.shape[1]
        back = int(np.ceil(delay / step - 1e-9)) + 1
        ago = step * np.arange(back, 0, -1)[:, None]
        at = back - delay / step
        low = int(np.floor(at + 1e-9))
        seen: list[np.ndarray] = []
        for values, ahead in zip((self._q, self._v), self._start(delay), strict=True):
            every = np.concatenate((values[:, :1] - ago * (ahead / delay)[:, None], values[:, :-1]), axis=1)
            older, newer = every[:, low : low + count], every[:, low + 1 : low + 1 + count]
            seen.append(older + max(at - low, 0.0) * (newer - older))
        return self._servos.torque(seen[0], seen[1], self._servos.controls(self._path.control))

    def _start(self, delay: float) -> np.ndarray:
        """By how much joints [rad] and speeds [rad/s] are ahead of `delay` [s] old readings at starts, (2, W, J)."""
        if ("start", delay) not in self._known:
            every = range(len(self._plant.joints))
            late, none, rule = np.full(len(every), delay), np.zeros(len(every)), self._plant.thresholds.path
            ahead, read = (read_at(self._windows, 0.0, d, every, rule) for d in (late, none))
            self._known["start", delay] = np.stack([a - b for a, b in zip(ahead, read, strict=True)])
        return self._known["start", delay]

    def _read_late(self, path: np.ndarray, delay: float) -> np.ndarray:
        """Change (W, N) at the ticks of what is read of a path (W, K + 1) that is due to its age alone."""
        ticks, step = self._windows.out_time, self._path.step
        return _at(self._windows, np.maximum(ticks - delay, 0.0), path, step) - _at(self._windows, ticks, path, step)


def _at(windows: Windows, times: np.ndarray, path: np.ndarray, step: float) -> np.ndarray:
    """Values (W, N) at `times` (W, N) of paths (W, K + 1), the start first."""
    states = path[..., None]
    return at_ticks(replace(windows, out_time=times), states[:, 0][None], states[:, 1:], step, 1)[0, ..., 0]
