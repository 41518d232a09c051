"""Steps by which a process is woken in time: no collector, memory locked, first in the queue where it is permitted."""

import ctypes
import gc
import os
from contextlib import suppress

_ALL = 3  # MCL_CURRENT | MCL_FUTURE
GUARD, POLICY, ROBOT = 60, 50, 40
"""Priorities: the guard comes before those that it waits for."""


def harden(priority: int) -> list[str]:
    """Prepare this process for its loop, once all is imported; the names of what was permitted."""
    gc.collect()
    gc.freeze()
    gc.disable()
    done = ["no garbage collection"]
    with suppress(OSError, AttributeError):
        if ctypes.CDLL(None).mlockall(_ALL) == 0:
            done.append("memory locked")
    with suppress(OSError, AttributeError):  # AttributeError: not on this system
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
        done.append("SCHED_FIFO")
    return done
