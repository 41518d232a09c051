"""Arrays that took long to make, kept by what they were made from: a retargeted motion, by its file and the settings.

An entry is `<2 digits>/<the others>.npz` under the cache's folder, by the sha256 of everything that decides the result
(`key_of`). It is written whole or not at all, checked when it is read, and made again where it is damaged; several
processes may use one cache. Beyond a size the entries that were used longest ago go.
"""

import contextlib
import hashlib
import io
import json
import os
import re
import threading
import time
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.io.limits import Limits
from bumblebee.io.read import npz_arrays, read_bytes
from bumblebee.io.whole import put

Arrays = dict[str, np.ndarray]

MOST_BYTES = 20 << 30
"""Size of a cache: 200,000 motions of 8 s."""
VARIABLE = "BUMBLEBEE_CACHE"
"""Environment variable that names another folder for the user's cache; empty: nothing is kept."""
_LIMITS = Limits(file_bytes=1 << 28, unpacked_bytes=1 << 28, members=64)  # of one entry
_KEY = re.compile(r"[0-9a-f]{64}")
_KINDS = "biuf"  # of arrays: truth, whole numbers, real numbers
_DATE = (1980, 1, 1, 0, 0, 0)  # in the archive, so that equal arrays give equal bytes
_CHECK = "sha256"  # the member that has the hash of all others
_LEEWAY = 0.9  # of the size is left after a clearing, so that not every new entry begins one
_DAY = 86_400.0  # s: how exactly "used longest ago" is known
_counting = threading.Lock()
_grown: dict[Path, int] = {}  # bytes in each folder, as this process knows them


def user_cache() -> Path | None:
    """The user's own cache, shared by all folders that they work in; None where `VARIABLE` is empty."""
    named = os.environ.get(VARIABLE)
    if named is None:
        return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "bumblebee" / "retargets"
    return Path(named) if named else None


def key_of(parts: Mapping[str, object]) -> str:
    """The key of what is made from `parts`: sha256 of their JSON, whatever the order of the keys.

    Args:
        parts: hash of the file's bytes, settings, version of the code ...: text, numbers, None, lists, mappings.

    Raises:
        TypeError, ValueError: something that has no one form as JSON, such as a set, an object or NaN.
    """
    _require_plain(parts)
    text = json.dumps(parts, sort_keys=True, separators=(",", ":"), ensure_ascii=True, allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()


def cached(folder: Path, key: str, make: Callable[[], Arrays], most_bytes: int = MOST_BYTES) -> Arrays:
    """Arrays that `make` returns, from the cache where they are there.

    Args:
        folder: the cache; made if it is not there.
        key: of `key_of`.
        make: the arrays, of finite numbers, by names; called once at most. Its exceptions pass, and nothing is kept.
        most_bytes: size of the cache beyond which the entries that were used longest ago go.

    Raises:
        ValueError: a key of another form, an array that could not be read back (objects, NaN).
    """
    if not _KEY.fullmatch(key):
        raise ValueError(f"a key is 64 digits, not {key[:80]!r}")
    path = Path(folder) / key[:2] / f"{key[2:]}.npz"
    found = _read(path)
    if found is None:
        found = make()
        data = _packed(found)
        if _write(path, data):
            _grow(Path(folder), len(data), most_bytes, path)
    return found


def _read(path: Path) -> Arrays | None:
    """The entry, marked as used; None where there is none or it is damaged."""
    if not path.exists():
        return None
    try:
        arrays = npz_arrays(path, read_bytes(path, _LIMITS.file_bytes), _LIMITS)
    except BadInput:
        return None
    check = arrays.pop(_CHECK, np.zeros(0, np.uint8))
    if check.tobytes() != _digest(arrays) or _fault(arrays):
        return None
    with contextlib.suppress(OSError):  # read-only, or cleared meanwhile: it was read all the same
        if time.time() - path.stat().st_mtime > _DAY:  # at each use, DVC would hash each entry again
            os.utime(path)
    return arrays


def _write(path: Path, data: bytes) -> bool:
    """Put an entry in its place; False where the disk does not take it, since what was made is good all the same."""
    try:
        put(path, data)
    except OSError:
        return False
    return True


def _packed(arrays: Arrays) -> bytes:
    """Equal arrays give equal bytes."""
    if fault := _fault(arrays):
        raise ValueError(fault)
    sink = io.BytesIO()
    with zipfile.ZipFile(sink, "w", zipfile.ZIP_STORED) as archive:
        for name, values in {**arrays, _CHECK: np.frombuffer(_digest(arrays), np.uint8)}.items():
            member = io.BytesIO()
            np.lib.format.write_array(member, np.ascontiguousarray(values), version=(1, 0), allow_pickle=False)
            archive.writestr(zipfile.ZipInfo(f"{name}.npy", _DATE), member.getvalue())
    return sink.getvalue()


def _fault(arrays: Arrays) -> str:
    """Why these arrays cannot be an entry; "" where they can."""
    for name, values in arrays.items():
        if not re.fullmatch(r"\w+", name) or name == _CHECK:
            return f"an array cannot be named {name[:60]!r}"
        if values.dtype.kind not in _KINDS:
            return f"{name}: arrays of numbers are kept, not of {values.dtype}"
        if values.dtype.kind == "f" and not np.isfinite(values).all():
            return f"{name}: not all of it is finite"
    return ""


def _digest(arrays: Arrays) -> bytes:
    """Hash of names, types, shapes and values."""
    digest = hashlib.sha256()
    for name in sorted(arrays):
        values = np.ascontiguousarray(arrays[name])
        digest.update(f"{name} {values.dtype.str} {values.shape};".encode())
        digest.update(values.tobytes())
    return digest.digest()


def _grow(folder: Path, size: int, most_bytes: int, kept: Path) -> None:
    """Count a new entry; clear the oldest where the cache is too large. A folder is gone through only then."""
    with _counting:
        place = folder.resolve()
        if place not in _grown:
            _grown[place] = sum(length for _, length, _ in _entries(folder))
        else:
            _grown[place] += size
        if _grown[place] <= most_bytes:
            return
        entries = sorted(_entries(folder))
        left = sum(length for _, length, _ in entries)
        for _, length, path in entries:
            if left <= most_bytes * _LEEWAY:
                break
            if path != kept:
                path.unlink(missing_ok=True)  # another process may have cleared it
                left -= length
        _grown[place] = left


def _entries(folder: Path) -> list[tuple[int, int, Path]]:
    """(when it was last used, bytes, path) of each entry; others may come and go meanwhile."""
    found = []
    for path in folder.glob("[0-9a-f][0-9a-f]/*.npz"):
        try:
            facts = path.stat()
        except FileNotFoundError:
            continue
        found.append((facts.st_mtime_ns, facts.st_size, path))
    return found


def _require_plain(value: object) -> None:
    """Refuse what JSON would write like something else: 1 and "1" as keys, tuples of named fields, paths."""
    if isinstance(value, Mapping):
        for key, inner in value.items():
            if not isinstance(key, str):
                raise TypeError(f"keys are text, not {key!r}")
            _require_plain(inner)
    elif isinstance(value, list | tuple):
        for inner in value:
            _require_plain(inner)
    elif value is not None and not isinstance(value, str | int | float | bool):
        raise TypeError(f"{type(value).__name__} has no one form as JSON: give text or numbers")
