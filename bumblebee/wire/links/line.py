"""Faults of a line: messages that come late, in bursts or never; drawn from a seed."""

import heapq
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from bumblebee.ranges import Range, Ranged, Share
from bumblebee.wire.clock import SECOND

Seconds = Annotated[float, Range(least=0, most=60)]


@dataclass(frozen=True)
class LineFaults(Ranged):
    """Faults of one direction of a wire."""

    delay: Seconds = 0.0
    """Delay of every message [s]."""
    jitter: Seconds = 0.0
    """Largest further delay of a message, drawn evenly [s]."""
    dropped: Share = 0.0
    """Share of the messages that never arrive."""
    late: Share = 0.0
    """Share of the messages that come `late_by` later than the others."""
    late_by: Seconds = 0.05
    """[s]."""


class Line:
    """Messages under way.

    Args:
        faults: of this direction.
        rng: of its own.
    """

    def __init__(self, faults: LineFaults, rng: np.random.Generator) -> None:
        self._faults, self._rng, self._count = faults, rng, 0
        self._waiting: list[tuple[int, int, str, bytes]] = []

    def push(self, now: int, channel: str, message: bytes) -> None:
        """Send a message at `now` [ns]."""
        faults, (lost, late, jitter) = self._faults, self._rng.random(3)
        if lost < faults.dropped:
            return
        delay = faults.delay + faults.jitter * jitter + faults.late_by * (late < faults.late)
        self._count += 1
        heapq.heappush(self._waiting, (now + round(SECOND * delay), self._count, channel, message))

    def due(self, now: int) -> list[tuple[str, bytes]]:
        """Channel and bytes of what has arrived by `now` [ns], in the order of arrival."""
        found = []
        while self._waiting and self._waiting[0][0] <= now:
            found.append(heapq.heappop(self._waiting)[2:])
        return found
