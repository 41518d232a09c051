"""Work on one item after the other in several processes, with the results in the items' order."""

import multiprocessing
import os
import signal
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from itertools import chain, islice
from typing import TypeVar

from threadpoolctl import threadpool_limits

Item = TypeVar("Item")
Result = TypeVar("Result")
_FEW = 8  # items: for fewer, processes take longer to start than they save
_AHEAD = 2  # items a process, finished or waiting: what bounds the memory
_LOOK = 1.0  # s between looks at whether the parent still lives


def in_order(work: Callable[[Item], Result], items: Iterable[Item], processes: int = 0) -> Iterator[Result]:
    """`work(item)` for each item, in order.

    Args:
        work: a function of a module, or a `partial` of one: it goes to other processes.
        items: taken one by one as there is room, so that they need not be in memory at once.
        processes: how many; 0: as many as there are cores.
    """
    items = iter(items)
    first = list(islice(items, _FEW))
    processes = processes or cores()
    if processes < 2 or len(first) < _FEW:
        with threadpool_limits(
            1, user_api="blas"
        ):  # small matrices: on a busy machine several threads wait for each other
            yield from map(work, chain(first, items))
        return
    # Spawned, not forked: the parent may have threads.
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(processes, context, initializer=_begin, initargs=(os.getpid(),)) as pool:
        waiting: deque[Future[Result]] = deque()
        try:
            for item in chain(first, items):
                waiting.append(pool.submit(work, item))
                if len(waiting) > _AHEAD * processes:
                    yield waiting.popleft().result()
            while waiting:
                yield waiting.popleft().result()
        except BaseException:
            for future in waiting:
                future.cancel()
            for process in list((pool._processes or {}).values()):  # `terminate_workers` from Python 3.14 on
                process.terminate()  # nobody waits for what they do now, which may take minutes
            raise


def cores() -> int:
    """How many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _begin(parent: int) -> None:
    """Leave Ctrl-C to the parent, end with it, and compute on one core: each process has one of its own."""
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")  # read when NumPy is imported, with the work
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with, args=(parent,), daemon=True).start()


def _end_with(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(_LOOK)
    os._exit(1)
