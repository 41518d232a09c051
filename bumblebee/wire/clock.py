"""Monotonic clock of the wire's processes, which may run slower than real time together."""

import time
from dataclasses import dataclass

SECOND = 1_000_000_000
"""Nanoseconds in a second."""


@dataclass(frozen=True)
class Clock:
    """Time that passes `slow` times slower than on the wall; every process of a run is given the same factor."""

    slow: float = 1.0
    """1 is real time; 4 lets a busy machine try everything at a quarter of the speed."""

    def now(self) -> int:
        """Time now [ns]."""
        return int(time.monotonic_ns() / self.slow)

    def sleep_until(self, deadline: int) -> None:
        """Sleep until a deadline [ns]; return at once where it has passed."""
        left = deadline - self.now()
        if left > 0:
            time.sleep(left * self.slow / SECOND)

    def spin_until(self, deadline: int) -> None:
        """Keep the core until a deadline [ns] that is near."""
        while self.now() < deadline:
            pass
