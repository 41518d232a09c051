"""How many CPU threads torch uses, and one beside them."""

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import TypeVar

import torch

T = TypeVar("T")


@contextmanager
def one_thread() -> Iterator[None]:
    """Let torch work on one thread: operations of microseconds are slower on two, on a busy machine by far."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)


class Aside:
    """Long work without Python, on a thread of its own while the caller does other work.

    Args:
        threads: with less than two there is no such thread, and work is done at once.
    """

    def __init__(self, threads: int) -> None:
        self._pool = ThreadPoolExecutor(1) if threads > 1 else None

    def __call__(self, work: Callable[[], T]) -> Callable[[], T]:
        """Begin the work; what comes back waits for its result. One work after the other, in the order of the calls."""
        if self._pool is None:
            result = work()
            return lambda: result
        return self._pool.submit(work).result
