"""Early end of a search: the simulator asks before each batch whether what is going on may go on."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field


class OutOfTime(Exception):
    """Raised in the middle of a search that must end."""


@dataclass(eq=False)
class Stop:
    """The reasons for which a diagnosis or a plan ends its search early, and reports what it has."""

    minutes: float = float("inf")
    """Time for the whole of it [min], by the clock."""
    asked: bool = False
    """Whether the user has asked for the end."""
    searching: bool = False
    """Whether there is something to report yet."""
    opened: float = 0.0
    """How long it took [s] to make the windows and propagate their noise: what must come in the end is told in it."""
    last_fit: float = 2.0
    """Times that which the last fit and the errors take, ..."""
    an_effect: float = 0.65
    """... and each effect beside. Measured on three robots: 3.8, 2.2 and 18 times it with 3, 2 and 25 effects."""
    began: float = field(default_factory=time.monotonic)

    def over(self, effects: int) -> bool:
        """Whether the user asked, or the time left is what the last fit, intervals and errors of so many take."""
        return self.before(self.opened * (self.last_fit + self.an_effect * effects))

    def before(self, ahead: float) -> bool:
        """Whether the user asked, or what takes `ahead` [s] would end after the time."""
        return self.asked or time.monotonic() - self.began + ahead > 60.0 * self.minutes


_OVER: ContextVar[Callable[[], bool] | None] = ContextVar("over", default=None)


@contextmanager
def ending(over: Callable[[], bool]) -> Iterator[None]:
    """Within, `check` raises `OutOfTime` once `over` is true."""
    token = _OVER.set(over)
    try:
        yield
    finally:
        _OVER.reset(token)


def check() -> None:
    """Go on, or raise `OutOfTime`."""
    over = _OVER.get()
    if over is not None and over():
        raise OutOfTime
