"""Which orders a robot takes: one controller's, newer than the last, for its joints, within its drives' gains."""

from collections import Counter

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.wire.clock import SECOND
from bumblebee.wire.links.lcm_codec import Codec
from bumblebee.wire.messages import Card, Mode, Order

DEADLINE = 0.02
"""A robot damps by itself when no order has come for so long [s]."""
RELEASE = 0.5
"""A controller that is silent for so long [s] is forgotten, and another one may speak."""


class Hearing:
    """The order in force on a robot, and what became of the others.

    Args:
        card: whose gains are the largest that it takes.
        layout: of its joints.
    """

    def __init__(self, card: Card, layout: int) -> None:
        self._card, self._layout, self._codec = card, layout, Codec(len(card.joints))
        self.order: Order | None = None
        """Newest order that was taken; None before the first, and once its controller is forgotten."""
        self.came = 0
        """When it came [ns]."""
        self.refused: Counter[str] = Counter()
        """Reason -> orders that were not taken."""

    def take(self, now: int, message: bytes) -> None:
        """Take an order at `now` [ns], or count why not."""
        try:
            order = self._codec.order(message)
        except BadInput:
            self.refused["no message"] += 1
            return
        if reason := self._unfit(order):
            self.refused[reason] += 1
        else:
            self.order, self.came = order, now

    def mode(self, now: int) -> Mode:
        """Mode of the drives at `now` [ns]: as the order says, DAMP where it is too old, OFF without one."""
        if self.order is not None and now - self.came > RELEASE * SECOND:
            self.order = None
        if self.order is None:
            return Mode.OFF if self.came == 0 else Mode.DAMP
        return self.order.mode if now - self.came < DEADLINE * SECOND else Mode.DAMP

    def _unfit(self, order: Order) -> str:
        last = self.order
        if order.layout != self._layout:
            return "another layout"
        if last is not None and order.controller != last.controller:
            return "another controller"
        if last is not None and order.sequence <= last.sequence:
            return "an old order"
        if not all(np.isfinite(values).all() for values in (order.target, order.kp, order.kd, order.torque)):
            return "no numbers"
        beyond = (order.kp > self._card.kp_most) | (order.kd > self._card.kd_most) | (order.kp < 0) | (order.kd < 0)
        return "gains" if beyond.any() else ""
