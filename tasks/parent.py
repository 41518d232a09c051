"""A process that ends with the one that started it: a killed loop must not leave a stage writing behind it."""

import os
import sys
import threading
import time

LOOK_EVERY = 0.5  # [s]


def end_with_parent() -> None:
    """Watch the parent from a thread and end this process, whatever it does, when the parent is gone."""
    parent = os.getppid()
    if parent == 1:
        return

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(LOOK_EVERY)
        print("the process that started this one is gone: ending", file=sys.stderr, flush=True)
        os._exit(1)

    threading.Thread(target=watch, daemon=True, name="parent").start()
