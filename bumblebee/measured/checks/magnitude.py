"""The check of magnitude: numbers that no robot of this world can have given, and that nothing can be computed with."""

from dataclasses import dataclass

import numpy as np

from bumblebee.measured.checks.view import View
from bumblebee.measured.rollout import Rollout

# The most that a column may hold, a hundred times and more beyond any robot: a wheel that turned for a day at 10 rad/s
# stands at 1e6 rad, the fastest motors do 1e4 rad/s, stamps since 1970 are 1.7e9 s.
LARGEST: dict[str, tuple[float, str]] = {
    "time": (1e11, "s"),
    "joint_pos": (1e6, "rad"),
    "joint_vel": (1e5, "rad/s"),
    "joint_target": (1e6, "rad"),
    "joint_torque_cmd": (1e6, "N m"),
    "action": (1e6, ""),
    "joint_torque": (1e6, "N m"),
    "base_quat": (1e3, ""),
    "base_ang_vel": (1e4, "rad/s"),
    "base_lin_vel": (1e4, "m/s"),
    "base_pos": (1e6, "m"),
    "foot_force": (1e7, "N"),
}
LEAD = 1e3  # rad by which a target may lead the position: a servo that far behind is none
PERIOD = (1e-6, 1e4)  # s between two rows


@dataclass(frozen=True)
class Beyond:
    """The first value of a column that is too large."""

    column: str
    joint: int | None
    """Its place in the row, where the column has one value a joint."""
    row: int
    expected: str
    came: str


def beyond(rollout: Rollout) -> list[Beyond]:
    """The first value of every column that is beyond its limit; NaN and infinities are another check's."""
    found = []
    for column in ("time", *rollout.columns):
        most, unit = LARGEST[column]
        found += _first(rollout, column, getattr(rollout, column), most, f"at most {most:g} {unit}".strip())
    if rollout.joint_target is not None and not found:
        lead = rollout.joint_target - rollout.joint_pos
        found += _first(rollout, "joint_target", lead, LEAD, f"a target within {LEAD:g} rad of the position")
    if not found:
        found += _period(rollout.time)
    return found


def check_magnitude(view: View) -> None:
    """One finding a column."""
    for one in beyond(view.rollout):
        column = one.column if one.joint is None else view.label(one.column, one.joint)
        view.add(column, one.row, "magnitude", one.expected, one.came, fatal=True)


def _first(rollout: Rollout, column: str, values: np.ndarray, most: float, expected: str) -> list[Beyond]:
    flat = values.reshape(len(values), -1)
    bad = np.isfinite(flat) & (np.abs(flat) > most)
    if not bad.any():
        return []
    row = int(np.argmax(bad.any(axis=1)))
    place = int(np.argmax(bad[row]))
    joint = place if values.ndim == 2 and values.shape[1] == len(rollout.joints) else None
    return [Beyond(column, joint, row, expected, f"{flat[row, place]:.6g} ({int(bad.sum())} such values)")]


def _period(time: np.ndarray) -> list[Beyond]:
    """A median period that no logger has; steps back and repeats are another check's."""
    steps = np.diff(time)
    steps = steps[np.isfinite(steps) & (steps > 0)]
    period = float(np.median(steps)) if len(steps) else PERIOD[0]
    if PERIOD[0] <= period <= PERIOD[1]:
        return []
    expected = f"a period of {PERIOD[0]:g} to {PERIOD[1]:g} s"
    return [Beyond("time", None, 1, expected, f"a median period of {period:.6g} s")]
