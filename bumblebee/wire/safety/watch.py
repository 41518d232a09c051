"""How long things have lasted: a foot off the floor, a drive at its limit, a robot that takes no order."""

import numpy as np

from bumblebee.wire.clock import SECOND
from bumblebee.wire.messages import State
from bumblebee.wire.safety.limits import Drives, Limits


class Watch:
    """Durations that rules ask for, kept from tick to tick.

    Args:
        drives: of the robot.
        limits: what counts as still and as a standing foot.
        period: of the ticks [s].
    """

    def __init__(self, drives: Drives, limits: Limits, period: float) -> None:
        self._drives, self._limits, self._period = drives, limits, period
        self.air = 0.0
        """Time without a foot on the floor [s]; 0 where no force is measured."""
        self.stalled = np.zeros(len(drives.joints))
        """(J,) time at the torque limit without motion [s]."""
        self._heard: int | None = None
        self._heard_at = 0

    def look(self, state: State, over: np.ndarray, carries: bool) -> None:
        """Look at a state; `over` (J,) bool are the drives that are cut at their torque."""
        lifted = (state.foot_force < self._limits.foot_n).all()  # NaN is no foot that is lifted
        self.air = self.air + self._period if lifted and carries else 0.0
        still = np.abs(state.joint_vel) < self._limits.still * self._drives.speed
        self.stalled = np.where(over & still, self.stalled + self._period, 0.0)

    def deaf(self, state: State, now: int, sent: int) -> float:
        """Time [s] since the robot last took a new order, or since its first state where it took none.

        Or how old the newest order is that it had taken when it spoke, of as many as were `sent`: states that come in
        order and late tell of orders taken long ago.
        """
        if state.heard != self._heard:
            self._heard, self._heard_at = state.heard, now
        behind = (sent - state.heard) * self._period if 0 <= state.heard <= sent else 0.0
        return max((now - self._heard_at) / SECOND, behind)
