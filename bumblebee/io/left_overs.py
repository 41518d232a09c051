"""Left-overs of runs that were killed, beside their output: named after it and the process, cleared by the next run.

`.<name>.<process>.<random>.part` is an output that was not finished, `.<name>.<process>.old` the result that was to be
replaced: it comes back where nothing took its place.
"""

import contextlib
import hashlib
import os
import re
import shutil
from pathlib import Path

_LONG = 150  # bytes of a name; file systems take 255 with all that is put around it


def prefix(out: Path) -> str:
    """How the names of this process's temporary files beside `out` begin."""
    return f".{_stem(out)}.{os.getpid()}."


def clear(out: Path) -> None:
    """Remove what processes that are gone left beside `out`, and put back a result that one had moved away."""
    pattern = re.compile(rf"\.{re.escape(_stem(out))}\.(\d+)\.(?:\w+\.part|old)")
    for path in sorted(out.parent.iterdir()):
        match = pattern.fullmatch(path.name)
        if match is None or _alive(int(match[1])):
            continue
        if path.suffix == ".old" and not os.path.lexists(out):
            os.rename(path, out)
        elif path.is_dir() and not path.is_symlink():
            shutil.rmtree(path, ignore_errors=True)
        else:
            with contextlib.suppress(OSError):
                path.unlink()


def spare(folder: Path) -> Path:
    """Rename a temporary folder that is to stay, so that no later run clears it; its name from now on."""
    kept = folder.with_name(folder.name.lstrip(".").removesuffix(".part"))
    try:
        os.rename(folder, kept)
    except OSError:
        return folder
    return kept


def _stem(out: Path) -> str:
    name = out.name
    if len(name.encode()) <= _LONG:
        return name
    return f"{name[:30]}-{hashlib.sha256(name.encode()).hexdigest()[:8]}"


def _alive(process: int) -> bool:
    try:
        os.kill(process, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except OSError:  # somebody else's
        return True
    return True
