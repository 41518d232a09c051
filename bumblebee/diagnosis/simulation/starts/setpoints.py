"""Set-points of drives that filter, limit or profile their targets, along windows that start mid-trajectory.

They follow from the logged targets alone: a window's set-point begins where the targets since its rollout began have
brought it, and its controls are known before anything is simulated.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np

from bumblebee.diagnosis.simulation.plant import Plant
from bumblebee.diagnosis.simulation.starts.first_order import first_order
from bumblebee.diagnosis.simulation.windows import Windows
from bumblebee.measured.rollout import Rollout
from bumblebee.sim.effects import SETPOINTS, Effect, advance

_BYTES = 48e6  # of paths at once


@dataclass(frozen=True)
class SetPoint:
    """Set-point that one drive makes of its targets."""

    kind: str
    """One of `SETPOINTS`."""
    values: tuple[float, ...]
    """The effect's parameters."""
    actuator: int
    column: int
    """Column of the joint in the log."""
    scale: float
    """The actuator's input for a unit of what was logged."""
    torque: bool
    """Whether torques were logged, else targets."""
    memory: float
    """[s] after which the set-point knows nothing of where it was."""

    def logged(self, rollout: Rollout) -> np.ndarray:
        """The joint's commands (T,) in a rollout, as they were logged."""
        table = rollout.joint_torque_cmd if self.torque else rollout.joint_target
        assert table is not None  # the plant was made for such rollouts
        return table[:, self.column]


_begun: WeakKeyDictionary[Windows, dict[SetPoint, np.ndarray]] = WeakKeyDictionary()
"""Place and speed (W, 2) of set-points when the first commands of windows are issued."""


def setpoints_of(plant: Plant, effects: Sequence[Effect]) -> tuple[SetPoint, ...]:
    """Those of the plant's drives that `effects` say; on a joint without a drive there is none."""
    found = []
    for effect in effects:
        for place in (effect.where or plant.joints) if effect.effect in SETPOINTS else ():
            column = plant.joints.index(place)
            a = int(plant.actuator[column])
            if a >= 0 and np.isfinite(effect.value()) and effect.value() > 0:
                gear = float(plant.model.actuator_gear[a, 0])
                scale = 1.0 / (gear * float(plant.model.actuator_gainprm[a, 0])) if plant.torque_input else gear
                memory = plant.thresholds.history.set_point
                found.append(SetPoint(effect.effect, effect.values(), a, column, scale, plant.torque_input, memory))
    return tuple(found)


def follow(windows: Windows, point: SetPoint, delay: float, step: float, count: int) -> np.ndarray:
    """The actuator's input (W, count): the mean over each step of the set-point of the commands, `delay` [s] late.

    Between two commands the set-point and its integral are known in closed form.
    """
    time, command = windows.command_time, windows.command[..., point.actuator] / point.scale
    place, speed, area = np.empty_like(command), np.empty_like(command), np.zeros_like(command)
    place[:, 0], speed[:, 0] = _at_first_command(windows, point)
    for c in range(command.shape[1] - 1):
        lasts = time[:, c + 1] - time[:, c]
        grown, place[:, c + 1], speed[:, c + 1] = _moved(point, place[:, c], speed[:, c], command[:, c], lasts)
        area[:, c + 1] = area[:, c] + grown
    at = np.arange(count + 1) * step - delay
    k = np.maximum((time[:, None, :] <= at[:, None]).sum(axis=-1) - 1, 0)  # (W, count + 1)

    def known(table: np.ndarray) -> np.ndarray:
        return np.take_along_axis(table, k, axis=1)

    since = at - known(time)
    grown, *_ = _moved(point, known(place), known(speed), known(command), np.maximum(since, 0.0))
    integral = known(area) + grown + known(place) * np.minimum(since, 0.0)
    return point.scale * np.diff(integral, axis=1) / step


def _moved(
    point: SetPoint, at: np.ndarray, speed: np.ndarray, command: np.ndarray, time: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return advance(point.kind, point.values, at, speed, command, time)


def begin_setpoints(windows: Windows, points: Sequence[SetPoint]) -> None:
    """Work out where many set-points begin, those of a kind at once: one by one they take a twentieth of a search."""
    known = _begun.setdefault(windows, {})
    for kind in SETPOINTS if windows.source else ():
        some = [p for p in dict.fromkeys(points) if p.kind == kind and p not in known]
        size = max(1, int(_BYTES / (16.0 * sum(windows.source[i].frames for i in np.unique(windows.rollout)))))
        for first in range(0, len(some), size):
            part = some[first : first + size]
            known.update(zip(part, _states_at_first_command(windows, part), strict=True))


def _at_first_command(windows: Windows, point: SetPoint) -> tuple[np.ndarray, np.ndarray]:
    """Place and speed (W,) of the set-point when the windows' first known commands are issued."""
    if not windows.source:
        first = windows.command[:, 0, point.actuator] / point.scale
        return first, 0.0 * first
    begin_setpoints(windows, [point])
    states = _begun[windows][point]
    return states[:, 0], states[:, 1]


def _states_at_first_command(windows: Windows, points: Sequence[SetPoint]) -> np.ndarray:
    """States of P set-points of one kind at the first command, (P, W, 2)."""
    some, rows = np.unique(windows.rollout, return_inverse=True)
    paths = _paths([windows.source[i] for i in some], points)
    issued = [windows.source[i].time[k] for i, k in zip(windows.rollout, windows.start, strict=True)]
    firsts = np.array(issued) + windows.command_time[:, 0]
    ticks = [
        int(np.searchsorted(windows.source[i].time, t - 1e-9)) for i, t in zip(windows.rollout, firsts, strict=True)
    ]
    return np.stack([paths[row][:, tick] for row, tick in zip(rows, ticks, strict=True)], axis=1)


def _paths(rollouts: Sequence[Rollout], points: Sequence[SetPoint]) -> list[np.ndarray]:
    """Place and speed (P, T, 2) of P set-points of one kind as each command of each rollout is issued.

    They are at rest under a rollout's first command. Long rollouts are followed in parts side by side, each from so
    much earlier on that it no longer matters where the set-point was then.
    """
    parts = [(i, *part) for i, r in enumerate(rollouts) for part in _parts(r, points[0].memory)]
    longest = max(last - start for _, start, _, last in parts)
    command, lasts = np.empty((len(points), len(parts), longest)), np.zeros((len(parts), longest))
    for row, (i, start, _, last) in enumerate(parts):
        told = np.stack([point.logged(rollouts[i])[start:last] for point in points])
        command[:, row, : last - start], command[:, row, last - start :] = told, told[:, -1:]
        spans = np.diff(rollouts[i].time[start : last + 1])
        lasts[row, : len(spans)] = spans
    values = [np.array(each)[:, None] for each in zip(*(point.values for point in points), strict=True)]
    if points[0].kind == "command_filter":  # which is linear
        path = np.stack((_filtered(values[0], command, lasts), np.zeros_like(command)), axis=-1)
    else:
        path = _followed(points[0].kind, values, command, lasts)
    out = [np.empty((len(points), r.frames, 2)) for r in rollouts]
    for row, (i, start, first, last) in enumerate(parts):
        out[i][:, first:last] = path[:, row, first - start : last - start]
    return out


def _followed(kind: str, values: Sequence[np.ndarray], command: np.ndarray, lasts: np.ndarray) -> np.ndarray:
    """Place and speed (P, R, T, 2) as each of the commands (P, R, T), which last (R, T) [s], is issued."""
    path = np.zeros((*command.shape, 2))
    place, speed = command[..., 0], np.zeros(command.shape[:2])
    for k in range(command.shape[-1]):
        path[..., k, 0], path[..., k, 1] = place, speed
        _, place, speed = advance(kind, values, place, speed, command[..., k], lasts[:, k])
    return path


def _filtered(constants: np.ndarray, command: np.ndarray, lasts: np.ndarray) -> np.ndarray:
    """Outputs (P, R, T) of filters with time constants (P, 1) [s]; one by one, for a cache holds one."""
    out = np.empty_like(command)
    for p, told in enumerate(command):
        keep = np.exp(-lasts[:, :-1] / constants[p])
        out[p] = first_order(keep, (1.0 - keep) * told[:, :-1], told[:, :1])
    return out


def _parts(rollout: Rollout, memory: float) -> list[tuple[int, int, int]]:
    """Where to begin, and the ticks (first, last) that count, of each part of a rollout."""
    length = max(1, round(memory / float(np.median(np.diff(rollout.time)))))
    firsts = range(0, rollout.frames, length)
    return [(max(first - length, 0), first, min(first + length, rollout.frames)) for first in firsts]
