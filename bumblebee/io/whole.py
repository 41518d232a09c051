"""A file that appears whole or not at all, and nothing more: what is refused is told by who asks."""

import contextlib
import os
import threading
from pathlib import Path

from bumblebee.io import left_overs


def put(path: Path, data: bytes | memoryview) -> None:
    """Write a file beside `path`, then rename it; its folder is made where it lacks.

    A kill leaves a `.part` by the names of `left_overs`, whose `clear` removes it; where many files lie, that is the
    caller's to ask for.

    Raises:
        OSError: as the system says it; `bumblebee.io.write.write_file` makes one line of it.
    """
    fresh = path.with_name(f"{left_overs.prefix(path)}{threading.get_ident()}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        fresh.write_bytes(data)
        os.replace(fresh, path)
    finally:
        with contextlib.suppress(OSError):
            fresh.unlink(missing_ok=True)
