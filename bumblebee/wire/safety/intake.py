"""Which states of the robot count: newer than the last, of the same robot and joints, with numbers in them."""

from collections import Counter
from collections.abc import Sequence

import numpy as np

from bumblebee.wire.messages import State

_ALWAYS = ("joint_pos", "joint_vel", "base_quat", "base_ang_vel")
_UNIT = 0.05  # by which a quaternion's length may be off 1: zeros of a broken IMU would read as upright
_ODOMETRY = {"velocity": "base_lin_vel", "height": "base_pos", "place": "base_pos"}


def numbers_for(sensors: Sequence[str]) -> tuple[str, ...]:
    """Fields of a state that must be numbers for a policy that needs these `sensors`; others may be NaN."""
    return (*_ALWAYS, *dict.fromkeys(field for sensor, field in _ODOMETRY.items() if sensor in sensors))


def without_numbers(state: State, names: Sequence[str]) -> str:
    """First of these fields of a state that is not all numbers; "" for none."""
    return next((name for name in names if not np.isfinite(getattr(state, name)).all()), "")


class Intake:
    """The newest usable state, and what became of the others.

    Args:
        robot: the one that was checked before the start.
        layout: of its joints.
        numbers: its states' fields that must be numbers.
        now: when watching begins [ns].
    """

    def __init__(self, robot: int, layout: int, numbers: Sequence[str], now: int) -> None:
        self._robot, self._layout, self._numbers = robot, layout, numbers
        self.state: State | None = None
        """Newest usable one."""
        self.came = now
        """When it came [ns]."""
        self.refused: Counter[str] = Counter()
        """Reason -> states that were not used."""

    def take(self, now: int, state: State) -> None:
        """Use a state that came at `now` [ns], or count why not."""
        if reason := self._unfit(state):
            self.refused[reason] += 1
        else:
            self.state, self.came = state, now

    def age(self, now: int) -> float:
        """Time since the newest usable state came [s]."""
        return (now - self.came) * 1e-9

    def _unfit(self, state: State) -> str:
        last = self.state
        if state.robot != self._robot:
            return "another robot, or one that booted again"
        if state.layout != self._layout:
            return "another layout"
        if last is not None and state.sequence == last.sequence:
            return "repeated"
        if last is not None and (state.sequence < last.sequence or state.stamp_ns <= last.stamp_ns):
            return "out of order"
        if without_numbers(state, self._numbers):
            return "no numbers"
        return "" if abs(np.linalg.norm(state.base_quat) - 1.0) < _UNIT else "no orientation"
