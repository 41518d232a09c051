"""Which states of the robot count: newer than the last, of the same robot and joints, with numbers in them."""

from collections import Counter

import numpy as np

from bumblebee.wire.messages import State

_NUMBERS = ("joint_pos", "joint_vel", "joint_torque", "base_quat", "base_ang_vel", "base_lin_vel", "base_pos")


class Intake:
    """The newest usable state, and what became of the others.

    Args:
        robot: the one that was checked before the start.
        layout: of its joints.
        now: when watching begins [ns].
    """

    def __init__(self, robot: int, layout: int, now: int) -> None:
        self._robot, self._layout = robot, layout
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
        return "" if all(np.isfinite(getattr(state, name)).all() for name in _NUMBERS) else "no numbers"
