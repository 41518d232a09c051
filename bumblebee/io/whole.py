"""A file that appears whole or not at all, and nothing more: what is refused is told by who asks."""

import contextlib
import os
import threading
from pathlib import Path


def put(path: Path, data: bytes | memoryview) -> None:
    """Write a file beside `path`, then rename it; its folder is made where it lacks.

    Raises:
        OSError: as the system says it; `bumblebee.io.write.write_file` makes one line of it.
    """
    fresh = path.with_name(f".{path.name}.{os.getpid()}.{threading.get_ident()}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        fresh.write_bytes(data)
        os.replace(fresh, path)
    finally:
        with contextlib.suppress(OSError):
            fresh.unlink(missing_ok=True)
