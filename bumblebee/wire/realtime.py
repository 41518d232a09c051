"""Steps by which a process is woken in time: no collector, memory locked, first in the queue where it is permitted."""

import ctypes
import gc
import os
import struct
from contextlib import suppress

_ALL = 3  # MCL_CURRENT | MCL_FUTURE
GUARD, POLICY, ROBOT = 60, 50, 0
"""Priorities of SCHED_FIFO: the guard comes before the policy. The simulated robot has none: it takes most of a core,
and Linux stops those that have one for 50 ms once they have taken 95 % of it. It comes before ordinary programs."""
_AWAKE = "/dev/cpu_dma_latency"
"""Takes the latency [us] with which a core may wake up, for as long as it is open."""


def harden(priority: int) -> list[str]:
    """Prepare this process for its loop, once all is imported; the names of what was permitted."""
    gc.collect()
    gc.freeze()
    gc.disable()
    done = ["no garbage collection"]
    with suppress(OSError, AttributeError):
        if ctypes.CDLL(None).mlockall(_ALL) == 0:
            done.append("memory locked")
    with suppress(OSError):  # open as long as the process lives
        os.write(os.open(_AWAKE, os.O_WRONLY), struct.pack("i", 0))
        done.append("cores kept awake")
    with suppress(OSError, AttributeError):  # AttributeError: not on this system
        if not priority:
            os.nice(-15)
            return [*done, "a high priority"]
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
        done.append("SCHED_FIFO")
    return done
