"""Windows: short stretches of the logs, each restarted from its measured state and fed the logged commands."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bumblebee.diagnosis.simulation.plant import Plant
from bumblebee.diagnosis.simulation.readings import Layout, measured_readings
from bumblebee.diagnosis.simulation.starts.base_height import stance_heights
from bumblebee.diagnosis.thresholds.simulation import Windowing
from bumblebee.errors import BadInput
from bumblebee.measured.rollout import Rollout
from bumblebee.quaternions import rotate_by_cross

_LEAD_SHARE = 0.25
"""Share of a rollout that the lead may take at most."""
_BRIEF = 0.004
"""Longest gap between rows that is none [s]: of a fast log a row is lost now and then, and a command held for so much
longer moves no joint by more than its neighbours' rows tell. Without it a log of 2 kHz that lost 1 % has no window."""


@dataclass(frozen=True, eq=False)
class Windows:
    """W windows of N compared ticks each."""

    rollout: np.ndarray
    """(W,) index of the rollout."""
    start: np.ndarray
    """(W,) tick of the start."""
    span: float
    """Length that is simulated [s]: the longest of the windows."""
    out_time: np.ndarray
    """(W, N) time of the compared ticks after the start [s]."""
    qpos: np.ndarray
    """(W, nq) measured start, with the encoders' readings as they are."""
    qvel: np.ndarray
    """(W, nv)."""
    measured: np.ndarray
    """(W, N, D) readings."""
    quat: np.ndarray | None
    """(W, N, 4) base orientation."""
    command: np.ndarray
    """(W, C, nu) logged commands around the window, in the actuators' own input."""
    command_time: np.ndarray
    """(W, C) times at which they were issued, after the start [s]."""
    condition: np.ndarray
    """(W,) number of the condition that it was recorded under, as the plant counts them."""
    source: Sequence[Rollout] = ()
    """The rollouts that `rollout` counts, for what drives remember from before the start."""
    stance: bool = False
    """Whether the base's height is not measured but taken from stance, by the readings as they are."""

    def __len__(self) -> int:
        return len(self.start)


def choose_starts(
    rollouts: Sequence[Rollout],
    ids: Sequence[int],
    horizon: float,
    budget: int,
    rule: Windowing | None = None,
) -> list[tuple[int, int, int]]:
    """At most `budget` windows (rollout, first tick, last tick), apart from each other and spread over the rollouts.

    Every rollout has the same share of the budget, as far as it is long enough: one long run must not decide alone.
    A window is `horizon` s long by its time stamps, to the nearest tick, whatever the rate; none holds a gap in the
    log, for nobody knows what was commanded there.
    """
    rule = rule or Windowing()
    every = [[(i, first, last) for first, last in _stretches(rollouts[i].time, horizon, rule)] for i in ids]
    quota = _shares([len(part) for part in every], budget)
    picked = []
    for part, count in zip(every, quota, strict=True):
        some = np.linspace(0, len(part) - 1, count + 2)[1:-1] if count < len(part) else np.arange(len(part))
        picked += [part[k] for k in np.unique(np.round(some).astype(int))]
    return picked


def _shares(lengths: Sequence[int], budget: int) -> list[int]:
    """How many of each one's windows to take, equal as far as they go; together at most `budget`."""
    shares, left = [0] * len(lengths), min(budget, sum(lengths))
    while left > 0:
        open_ = [k for k, n in enumerate(lengths) if shares[k] < n]
        each = left // len(open_)
        if each == 0:
            for k in np.linspace(0, len(open_) - 1, left).round().astype(int):
                shares[open_[k]] += 1
            break
        for k in open_:
            more = min(each, lengths[k] - shares[k])
            shares[k] += more
            left -= more
    return shares


def _stretches(time: np.ndarray, horizon: float, rule: Windowing) -> list[tuple[int, int]]:
    """Consecutive stretches (first, last) of `horizon` s within the stamps `time` (T,)."""
    period = float(np.median(np.diff(time)))
    gaps = np.concatenate(([0], np.cumsum(np.diff(time) > max(rule.gap * period, _BRIEF))))
    last = np.searchsorted(time, time + horizon + 0.5 * period - 1e-9) - 1
    last = np.maximum(last, np.minimum(np.arange(len(time)) + 1, len(time) - 1))
    off = np.abs(time[last] - time - horizon)
    good = (off <= 0.51 * period + 1e-9) & (gaps[last] == gaps)
    found = []
    k = int(np.searchsorted(time, time[0] + min(rule.lead, _LEAD_SHARE * (time[-1] - time[0]))))
    while k < len(time) - 1:
        if good[k]:
            found.append((k, int(last[k])))
            k = int(last[k])
        else:
            k += 1
    return found


def cut(
    plant: Plant,
    layout: Layout,
    rollouts: Sequence[Rollout],
    starts: list[tuple[int, int, int]],
    outputs: int | None = None,
) -> Windows:
    """Cut the windows; at most `outputs` ticks of each are compared (the plant's rule's), the last among them."""
    rule = plant.thresholds.windows
    outputs = rule.outputs if outputs is None else outputs
    firsts = {
        i: max(1, round(rule.first_output / float(np.median(np.diff(rollouts[i].time)))))
        for i in {s[0] for s in starts}
    }
    count = min(outputs, *(max(1, last - k - firsts[i] + 1) for i, k, last in starts))
    cache = {i: measured_readings(rollouts[i], layout) for i in {s[0] for s in starts}}
    commands = {i: _every_command(rollouts[i].time, command_inputs(plant, rollouts[i]), rule) for i in cache}
    heights = stance_heights(plant, rollouts, {s[0] for s in starts}) if _needs_height(plant, layout) else {}
    rows = []
    for i, k, last in starts:
        picks = np.linspace(last - k, min(firsts[i], last - k), count)[::-1]  # one output: the last tick
        picks = np.floor(picks + 0.5).astype(int)
        rows.append(_one(plant, rollouts[i], cache[i], commands[i], heights.get(i), k, picks))
    size = max(len(row.command_time) for row in rows)
    quats = [row.quat for row in rows if row.quat is not None]
    return Windows(
        rollout=np.array([s[0] for s in starts]),
        start=np.array([s[1] for s in starts]),
        span=max(float(row.out_time[-1]) for row in rows),
        out_time=np.stack([row.out_time for row in rows]),
        qpos=np.stack([row.qpos for row in rows]),
        qvel=np.stack([row.qvel for row in rows]),
        measured=np.stack([row.measured for row in rows]),
        quat=np.stack(quats) if quats else None,
        command=np.stack([_pad(row.command, size) for row in rows]),
        command_time=np.stack([_pad(row.command_time, size) for row in rows]),
        condition=np.array([plant.under.get(rollouts[s[0]].rollout_id, 0) for s in starts]),
        source=rollouts,
        stance=_needs_height(plant, layout),
    )


def select(windows: Windows, keep: np.ndarray) -> Windows:
    """The windows at the indices or mask `keep`."""
    parts = {name: getattr(windows, name) for name in windows.__dataclass_fields__}
    kept = {name: value[keep] if isinstance(value, np.ndarray) else value for name, value in parts.items()}
    return Windows(**kept)


def controls(windows: Windows, delay: np.ndarray, step: float, count: int) -> np.ndarray:
    """Commands (W, count, nu) for steps of `step` s: the mean over each step of the held, delayed command."""
    time, command = windows.command_time, windows.command
    area = np.zeros_like(command)
    np.cumsum(np.diff(time, axis=1)[..., None] * command[:, :-1], axis=1, out=area[:, 1:])
    out = np.empty((len(windows), count, len(delay)))
    for value in np.unique(delay):
        columns = np.flatnonzero(delay == value)
        at = np.arange(count + 1) * step - value
        k = np.maximum((time[:, None, :] <= at[:, None]).sum(axis=-1) - 1, 0)  # (W, count + 1)
        since = at - np.take_along_axis(time, k, axis=1)
        rows = np.arange(len(windows))[:, None, None]
        integral = area[rows, k[..., None], columns] + since[..., None] * command[rows, k[..., None], columns]
        out[..., columns] = np.diff(integral, axis=1) / step
    return out


def _needs_height(plant: Plant, layout: Layout) -> bool:
    return plant.floating and "base_pos" not in layout.slices


def _pad(values: np.ndarray, size: int) -> np.ndarray:
    """Repeat the last row; padded commands change nothing, for their times never pass."""
    return np.concatenate((values, np.repeat(values[-1:], size - len(values), axis=0)))


class _Window(NamedTuple):
    """One window, its fields as in `Windows`."""

    out_time: np.ndarray
    qpos: np.ndarray
    qvel: np.ndarray
    measured: np.ndarray
    quat: np.ndarray | None
    command: np.ndarray
    command_time: np.ndarray


def _one(
    plant: Plant,
    rollout: Rollout,
    readings: tuple[np.ndarray, np.ndarray | None],
    commands: tuple[np.ndarray, np.ndarray],
    heights: np.ndarray | None,
    k: int,
    picks: np.ndarray,
) -> _Window:
    signals, quat = readings
    t0 = rollout.time[k]
    issued, command = commands
    first = int(np.searchsorted(rollout.time, t0 - 2 * plant.thresholds.windows.lead))
    first, last = (int(np.searchsorted(issued, rollout.time[tick])) for tick in (first, k + int(picks[-1])))
    qpos, qvel = start_state(plant, rollout, k, None if heights is None else heights[k])
    return _Window(
        out_time=rollout.time[k + picks] - t0,
        qpos=qpos,
        qvel=qvel,
        measured=signals[k + picks],
        quat=None if quat is None else quat[k + picks],
        command=command[first : last + 1],
        command_time=issued[first : last + 1] - t0,
    )


def _every_command(time: np.ndarray, command: np.ndarray, rule: Windowing) -> tuple[np.ndarray, np.ndarray]:
    """When commands were issued (T',) and which (T', nu), with those of single rows that a log has lost.

    What the drive got there lies, for all that is known, between the commands before and after.
    """
    apart = np.diff(time)
    period = float(np.median(apart))
    brief = (apart > rule.gap * period) & (apart <= _BRIEF)  # a window holds no longer ones
    lost = np.where(brief, np.round(apart / period) - 1, 0).astype(int)
    if not lost.any():
        return time, command
    after = np.repeat(np.arange(len(lost)), lost)
    share = np.concatenate([np.arange(1, n + 1) / (n + 1) for n in lost[lost > 0]])
    ticks = np.arange(len(time))
    rows = np.sort(np.concatenate((ticks, after + share)))
    filled = np.stack([np.interp(rows, ticks, column) for column in command.T], axis=1)
    return np.interp(rows, ticks, time), filled


def start_state(plant: Plant, rollout: Rollout, k: int, height: float | None) -> tuple[np.ndarray, np.ndarray]:
    """The measured state of tick k as qpos (nq,) and qvel (nv,)."""
    qpos, qvel = plant.model.qpos0.copy(), np.zeros(plant.model.nv)
    qpos[plant.qpos], qvel[plant.dof] = rollout.joint_pos[k], rollout.joint_vel[k]
    if plant.floating:
        q, v = plant.base_qpos, plant.base_dof
        turn, speed, spin, place = rollout.base_quat, rollout.base_lin_vel, rollout.base_ang_vel, rollout.base_pos
        assert turn is not None and speed is not None and spin is not None  # `make_plant` saw to it
        quat = turn[k] / np.linalg.norm(turn[k])
        if height is None:
            assert place is not None
            qpos[q : q + 3] = place[k]
        else:
            qpos[q : q + 3] = [0.0, 0.0, height]
        qpos[q + 3 : q + 7] = quat
        qvel[v : v + 3] = rotate_by_cross(quat, speed[k])
        qvel[v + 3 : v + 6] = spin[k]
    return qpos, qvel


def command_inputs(plant: Plant, rollout: Rollout) -> np.ndarray:
    """Logged commands as the actuators' inputs, (T, nu)."""
    values = rollout.joint_torque_cmd if plant.torque_input else rollout.joint_target
    if values is None:
        raise BadInput(f"{rollout.rollout_id}: column joint_target", "the column that the other rollouts have", "none")
    out = np.zeros((rollout.frames, plant.model.nu))
    for column, a in enumerate(plant.actuator):
        if a >= 0:
            gear = plant.model.actuator_gear[a, 0]
            scale = 1.0 / (gear * plant.model.actuator_gainprm[a, 0]) if plant.torque_input else gear
            out[:, a] = values[:, column] * scale
    return out
