"""Memory of the drives at a window's start, from the log before it: clocks, heat, filters, play.

A window restarts a simulation in the middle of a rollout. Position and velocity are read; what is not read follows from
the readings and commands since the rollout began.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import lru_cache

import mujoco
import numpy as np

from bumblebee.diagnosis.simulation.joint_path import joint_path, joint_states
from bumblebee.diagnosis.simulation.plant import Plant
from bumblebee.diagnosis.simulation.starts.first_order import first_order
from bumblebee.diagnosis.simulation.windows import Windows, command_inputs
from bumblebee.diagnosis.thresholds.simulation import ActuatorHistory, JointPath
from bumblebee.measured.rollout import Rollout
from bumblebee.sim.effects import Memory, RuntimeHooks, State, bent, history_length, states_of
from bumblebee.sim.servo import Servos, servos_each, servos_of


def plant_servos(plant: Plant, model: mujoco.MjModel | None = None) -> Servos:
    """The servos of the plant's joints, in the log's column order, or those that `model` has there."""
    return _declared_servos(plant) if model is None else _servos(plant, model)


@lru_cache(maxsize=64)
def _declared_servos(plant: Plant) -> Servos:
    """Those of the plant's own model, which nobody writes to."""
    return _servos(plant, plant.model)


def _servos(plant: Plant, model: mujoco.MjModel) -> Servos:
    return servos_of(model, [int(model.joint(name).id) for name in plant.joints])


def window_servos(plant: Plant, windows: Windows, models: Sequence[mujoco.MjModel]) -> Servos:
    """The servos of each window's model, one of those under each condition, for states (W, K, J)."""
    servos = servos_each([plant_servos(plant, model) for model in models], windows.condition[:, None])
    supply = np.array([p.condition.supply for p in plant.every])[windows.condition][:, None, None]
    return servos if len(models) == 1 else replace(servos, supply=supply)


@lru_cache(maxsize=256)
def logged_torques(plant: Plant, rollout: Rollout) -> tuple[np.ndarray, np.ndarray]:
    """Servo torque (T, J) [N m] by the declared gains just before each tick and just after it."""
    servos = plant_servos(plant.of(rollout))
    command = servos.controls(command_inputs(plant, rollout))
    held = np.concatenate((command[:1], command[:-1]))
    place = rollout.joint_pos - plant.offset
    return (
        servos.torque(place, rollout.joint_vel, held),
        servos.torque(place, rollout.joint_vel, command),
    )


@lru_cache(maxsize=256)
def mean_squares(plant: Plant, rollout: Rollout) -> np.ndarray:
    """Mean square (T - 1, J) of the servo torques [N^2 m^2] between ticks, by Gauss's rule of four points.

    A command that arrives makes a torque that is gone before the next tick: the mean of the squares at both ends is a
    tenth too much. Between ticks the joint is on the cubic that has the readings' positions and speeds.
    """
    servos, dt = plant_servos(plant.of(rollout)), np.diff(rollout.time)[:, None]
    place, speed = rollout.joint_pos - plant.offset, rollout.joint_vel
    gone, command = np.diff(place, axis=0), servos.controls(command_inputs(plant, rollout))[:-1]
    ends = speed[:-1] - gone / dt, gone / dt - speed[1:]
    nodes, weights = np.polynomial.legendre.leggauss(4)
    total = np.zeros_like(gone)
    for s, weight in zip(0.5 * (1 + nodes), 0.5 * weights, strict=True):
        bow = s * (1 - s) * ((1 - s) * ends[0] + s * ends[1])
        slope = (1 - s) * (1 - 3 * s) * ends[0] + s * (2 - 3 * s) * ends[1]
        at = place[:-1] + s * gone + dt * bow
        total += weight * servos.torque(at, gone / dt + slope, command) ** 2
    return total


def _shares_of_limit(plant: Plant, rollout: Rollout) -> np.ndarray:
    """Mean squares (T - 1, J) of the servo torques as shares of their limits; of one without a limit in N m."""
    limit = plant_servos(plant.of(rollout)).limit
    return mean_squares(plant, rollout) / np.where(np.isfinite(limit), limit, 1.0) ** 2


@lru_cache(maxsize=256)
def full_heat(plant: Plant, rollout: Rollout) -> np.ndarray:
    """Heat (T, J) [s] of drives that lose no strength."""
    none = np.zeros(len(plant.joints))
    clock = rollout.time - rollout.time[0]
    return heated(clock, _shares_of_limit(plant, rollout), none, none, plant.thresholds.history)


def at_starts(windows: Windows, of: Callable[[Rollout], np.ndarray]) -> np.ndarray:
    """Rows (W, ...) of the tables `of` the windows' rollouts (T, ...) at their starts."""
    tables = {i: of(windows.source[i]) for i in np.unique(windows.rollout)}
    return np.stack([tables[i][k] for i, k in zip(windows.rollout, windows.start, strict=True)])


def remember(plant: Plant, windows: Windows, hooks: RuntimeHooks, step: float) -> Memory:
    """The memory of every window; its columns are the hooks' joints."""
    order = [plant.joints.index(name) for name in hooks.joints]
    thermal, drift = np.zeros(len(order)), np.zeros(len(order))
    thermal[order], drift[order] = hooks.thermal, hooks.drift

    def heat(rollout: Rollout) -> np.ndarray:
        if not (thermal.any() or drift.any()):
            return full_heat(plant, rollout)
        time, rule = rollout.time - rollout.time[0], plant.thresholds.history
        return heated(time, _shares_of_limit(plant, rollout), thermal, drift, rule)

    back = history_length(hooks, step)
    late = bool(hooks.torque_lag.any())
    past = _past(plant, windows, back, step, hooks.encoder_delay, order) if back else None
    return Memory(
        time=at_starts(windows, lambda r: r.time - r.time[0]),
        heat=at_starts(windows, heat)[:, order],
        torque=at_starts(windows, lambda r: lagged(plant, r, order, hooks.torque_lag)) if late else None,
        position=None if past is None else past[0] - hooks.encoder_offset,
        velocity=None if past is None else past[1],
        states=_states(plant, windows, hooks, order),
        bent=_bent(plant, windows, [(order[column], width) for column, _, width in hooks.hysteresis]),
    )


def _bent(plant: Plant, windows: Windows, columns: Sequence[tuple[int, float]]) -> np.ndarray | None:
    """Dahl's z (W, H) of joints (columns in the log) and widths [rad]."""
    if not columns:
        return None
    rule = plant.thresholds.path
    return np.stack([bent_before(windows, column, width, rule) for column, width in columns], axis=1)


def bent_before(windows: Windows, column: int, width: float, rule: JointPath) -> np.ndarray:
    """Dahl's z (W,) of a joint (a column of the log) at the windows' starts, its path followed from the first tick."""
    rows, paths = _together(windows, lambda rollout: joint_path(rollout, column, rule))
    out = np.zeros(paths.shape)
    for k in range(1, paths.shape[1]):
        out[:, k] = bent(out[:, k - 1], paths[:, k] - paths[:, k - 1], width)
    return out[rows, windows.start]


def _together(windows: Windows, of: Callable[[Rollout], np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Signals `of` (T,) of the windows' rollouts, (R, T) up to the last start, a shorter one kept at its last value.

    And which of the rows (W,) each window is of.
    """
    some, rows = np.unique(windows.rollout, return_inverse=True)
    last = int(windows.start.max()) + 1
    values = [of(windows.source[i])[:last] for i in some]
    return rows, np.stack([np.concatenate((v, np.full(last - len(v), v[-1]))) for v in values])


def _states(plant: Plant, windows: Windows, hooks: RuntimeHooks, order: Sequence[int]) -> np.ndarray | None:
    """Memory of discovered terms (W, C)."""
    kept = states_of(hooks.terms)
    if not kept:
        return None
    return np.stack([state_before(plant, windows, replace(s, column=order[s.column])) for s in kept], axis=1)


def state_before(plant: Plant, windows: Windows, state: State) -> np.ndarray:
    """A state (W,) of a joint (the column in the log) at the windows' starts, followed since the rollout began.

    Speeds are means over a few ticks: what a sensor's noise would wear off is no motion.
    """
    rows, clock = _together(windows, lambda rollout: _for_states(plant, rollout)[0])
    _, steps = _together(windows, lambda rollout: _for_states(plant, rollout)[1])
    _, speed = _together(windows, lambda rollout: _for_states(plant, rollout)[2][:, state.column])
    _, target = _together(windows, lambda rollout: _for_states(plant, rollout)[3][:, state.column])
    if len(clock) == 1:
        return state.followed(clock[0], steps[0], speed[0], target[0])[windows.start]
    return state.followed(clock, steps, speed, target)[rows, windows.start]


@lru_cache(maxsize=256)
def _for_states(plant: Plant, rollout: Rollout) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Times and steps (T,) [s], speeds and targets (T, J) of a rollout's joints."""
    servos = plant_servos(plant)  # targets are read off alike whatever the gains
    wide = np.ones(2 * plant.thresholds.history.smooth + 1)
    known = np.convolve(np.ones(len(rollout.time)), wide, mode="same")
    speed = np.stack([np.convolve(v, wide, mode="same") / known for v in rollout.joint_vel.T], axis=1)
    target = servos.given(servos.controls(command_inputs(plant, rollout)))
    clock, steps = rollout.time - rollout.time[0], np.diff(rollout.time, append=rollout.time[-1])
    return clock, steps, speed, target


def heated(
    time: np.ndarray,
    squares: np.ndarray,
    thermal: np.ndarray,
    drift: np.ndarray,
    rule: ActuatorHistory,
) -> np.ndarray:
    """Heat (T, J) [s] at the ticks `time` (T,) of a rollout: the integral of the square of what the drives gave.

    `squares` (T - 1, J) are mean squares between ticks of torques at full strength, as shares of the limit. A drive of
    strength 1 - thermal (J,) heat - drift (J,) time, here at most 1, gives less than is asked for and heats the less.
    """
    power = squares * np.diff(time)[:, None]
    out = np.concatenate((np.zeros((1, power.shape[1])), np.cumsum(power, axis=0)))
    some = np.flatnonzero((thermal != 0) | (drift != 0))
    for _ in range(rule.passes if len(some) else 0):
        strength = np.clip(1.0 - thermal[some] * out[:-1, some] - drift[some] * time[:-1, None], 0.0, 1.0)
        new = np.cumsum(strength**2 * power[:, some], axis=0)
        settled = np.abs(new - out[1:, some]).max(initial=0.0) < rule.settled
        out[1:, some] = new
        if settled:
            break
    return out


def lagged(plant: Plant, rollout: Rollout, order: Sequence[int], time: np.ndarray) -> np.ndarray:
    """State (T, J) of a first-order lag of the logged torque, whose course between ticks is linear."""
    before, after = (x[:, order].T for x in logged_torques(plant, rollout))
    dt, safe = np.diff(rollout.time), np.maximum(time, 1e-6)[:, None]
    keep = np.exp(-dt / safe)
    fed = (1 - keep) * after[:, :-1] + (before[:, 1:] - after[:, :-1]) / dt * (dt - safe * (1 - keep))
    return first_order(keep, fed, before[:, :1]).T


def _past(
    plant: Plant, windows: Windows, back: int, step: float, delay: np.ndarray, order: Sequence[int]
) -> tuple[np.ndarray, np.ndarray]:
    """Positions and velocities (W, back, J) at the `back` steps before each start, the newest last."""
    return _read_at_each(windows, -step * np.arange(back, 0, -1), delay, order, plant.thresholds.path)


def read_at(
    windows: Windows, shift: float, delay: np.ndarray, order: Sequence[int] | np.ndarray, rule: JointPath
) -> tuple[np.ndarray, np.ndarray]:
    """Positions and velocities (W, J) that the joints `order` had `shift` s after the starts, by their late readings.

    What an encoder reads `delay` (J,) s later is where the joint is now. Readings count without their noise
    (`joint_path`), for a later one is also one that the window is compared with: half of a tick later a start would
    have the mean noise of both ticks and thus half of its variance, and a joint at rest would gain by a late encoder.
    Between ticks a position is on the cubic that has the positions and speeds of both, a speed on a line.
    """
    place, speed = _read_at_each(windows, np.array([shift]), delay, order, rule)
    return place[:, 0], speed[:, 0]


def _read_at_each(
    windows: Windows, shifts: np.ndarray, delay: np.ndarray, order: Sequence[int] | np.ndarray, rule: JointPath
) -> tuple[np.ndarray, np.ndarray]:
    """Readings (W, S, J) at several shifts (S,) at once."""
    place, speed = np.empty((2, len(windows), len(shifts), len(order)))
    for i in np.unique(windows.rollout):
        own, source = windows.rollout == i, windows.source[i]
        time = source.time
        for column, joint in enumerate(order):
            state = joint_states(source, joint, rule)
            at = np.clip(time[windows.start[own], None] + shifts + delay[column], time[0], time[-1])
            high = np.clip(np.searchsorted(time, at), 1, len(time) - 1)
            dt = time[high] - time[high - 1]
            share, (first, speed_before) = (at - time[high - 1]) / dt, np.moveaxis(state[high - 1], -1, 0)
            last, speed_after = np.moveaxis(state[high], -1, 0)
            gone = last - first
            bow = (1 - share) * (dt * speed_before - gone) + share * (gone - dt * speed_after)
            place[own, :, column] = first + share * gone + share * (1 - share) * bow
            speed[own, :, column] = speed_before + share * (speed_after - speed_before)
    return place, speed


def yielded(windows: Windows, column: int, width: float, rule: JointPath) -> np.ndarray:
    """Reference (W,) [rad] of an elasto-plastic spring of `width` on a joint, its path followed from the first tick."""
    rows, paths = _together(windows, lambda rollout: joint_path(rollout, column, rule))
    out = paths.copy()
    for k in range(1, paths.shape[1]):
        out[:, k] = np.clip(out[:, k - 1], paths[:, k] - width, paths[:, k] + width)
    return out[rows, windows.start]
