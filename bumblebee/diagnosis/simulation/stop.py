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
    """The reasons for which a diagnosis ends its searches early, and reports what it has."""

    minutes: float = float("inf")
    """Time for the whole of it [min], by the clock."""
    asked: bool = False
    """Whether the user has asked for the end."""
    searching: bool = False
    """Whether there is something to report yet."""
    search: float = 0.5
    """Share of the time after which the search ends, ..."""
    beyond: float = 0.6
    """... the look beyond the catalogue, ..."""
    finish: float = 0.7
    """... and what may still move the last fit: this fit, its intervals and errors always come."""
    began: float = field(default_factory=time.monotonic)

    def over(self, share: float) -> bool:
        """Whether the user asked, or this share of the time has gone."""
        return self.asked or time.monotonic() - self.began > share * 60.0 * self.minutes


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
