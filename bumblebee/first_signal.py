"""The first Ctrl-C or SIGTERM ends a search early, and what it has found is written; the second ends the process."""

import os
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

SIGNALS = (signal.SIGINT, signal.SIGTERM)


@contextmanager
def first_signal(take: Callable[[], bool]) -> Iterator[None]:
    """Within, `take` is called at the first of the signals; where it returns False the process ends as without this."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: signal.getsignal(number) for number in SIGNALS}

    def back() -> None:
        for number, handler in before.items():
            signal.signal(number, handler)

    def heard(number: int, frame: FrameType | None) -> None:
        back()
        if not take():
            os.kill(os.getpid(), number)

    for number in SIGNALS:
        if before[number] is not signal.SIG_IGN:
            signal.signal(number, heard)
    try:
        yield
    finally:
        back()
