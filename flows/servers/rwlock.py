"""DVC's record of which process reads and writes what, where a kill cut it off.

DVC writes `.dvc/tmp/rwlock` in place and believes it when it reads it: `kill -9` at that moment leaves half a file, and
every later command ends with RWLockFileCorruptedError. Who writes it holds a lock; half a file under that lock is
nobody's any more.
"""

import json
from contextlib import suppress
from pathlib import Path


def clear_cut_off(workspace: Path) -> None:
    """Remove the record if it is no JSON and nobody is writing it; processes that are gone are all it could name."""
    from dvc.lock import LockError, make_lock

    folder = Path(workspace) / ".dvc" / "tmp"
    record = folder / "rwlock"
    if is_whole(record):
        return
    with suppress(LockError), make_lock(str(folder / "rwlock.lock"), tmp_dir=str(folder)):
        if not is_whole(record):
            record.unlink(missing_ok=True)


def is_whole(record: Path) -> bool:
    """Whether the file is JSON, or is not there."""
    try:
        json.loads(record.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return True
    except ValueError:
        return False
    return True
