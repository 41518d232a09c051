"""The same work on every clip of a library, on all cores: the filter, statistics, features."""

import multiprocessing
import os
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from pathlib import Path
from typing import TypeVar

from bumblebee.errors import BadInput
from bumblebee.motion.clip import Clip
from bumblebee.motion.store.library import Library

Result = TypeVar("Result")
BATCH = 64  # clips that a process takes at a time
_AHEAD = 2  # batches a process, finished or waiting: what bounds the memory

_library: Library | None = None


def map_clips(folder: Path, work: Callable[[Clip], Result], processes: int | None = None) -> Iterator[Result]:
    """`work(clip)` for each clip, in the index's order.

    Args:
        folder: the library.
        work: a function of a module, or a `partial` of one: it goes to other processes.
        processes: how many; by default as many as there are cores, and none for few clips.

    Raises:
        BadInput: a damaged clip; whatever `work` raises.
    """
    library = Library(folder)
    processes = _cores() if processes is None else processes
    starts = range(0, len(library), BATCH)
    if processes < 2 or len(starts) < 2 * processes:
        yield from map(work, library)
        return
    # Spawned, not forked: torch and Arrow have threads in the parent.
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(processes, context, initializer=_begin, initargs=(Path(folder),)) as pool:
        waiting: deque[Future[list[Result]]] = deque()
        try:
            for start in starts:
                waiting.append(pool.submit(_batch, work, start, min(start + BATCH, len(library))))
                if len(waiting) > _AHEAD * processes:
                    yield from waiting.popleft().result()
            while waiting:
                yield from waiting.popleft().result()
        finally:
            for future in waiting:
                future.cancel()


def _begin(folder: Path) -> None:
    global _library
    _library = Library(folder)


def _batch(work: Callable[[Clip], Result], start: int, stop: int) -> list[Result]:
    assert _library is not None
    done = []
    for _, clip in _library.each(range(start, stop)):
        if isinstance(clip, BadInput):
            raise clip
        done.append(work(clip))
    return done


def _cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
