"""Importer of HDF5 logs: the map names the data sets, and the groups where a file holds an episode in each.

A file from elsewhere may point at other files (external links, external storage, virtual data sets): these are refused.
How much a data set holds is asked before it is read.
"""

import fnmatch
import io
from pathlib import Path
from typing import Any

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.io.limits import Limits
from bumblebee.io.read import require_real
from bumblebee.measured.importers.column_map import SECONDS, ColumnMap
from bumblebee.measured.importers.extras import library
from bumblebee.measured.importers.mapped import rollouts_of
from bumblebee.measured.importers.source import open_source, rollout_names
from bumblebee.measured.rollout import Rollout

ENDINGS = (".h5", ".hdf5")
_CELL = 8  # bytes of a number in memory


def import_hdf5(place: Path, chosen: ColumnMap) -> list[Rollout]:
    """Every HDF5 file of a folder or zip archive, or one file."""
    h5py = library("hdf5", "h5py")
    source = open_source(place)
    rollouts = []
    for ending in ENDINGS:
        names = source.ending(ending)
        ids = rollout_names(names, ending)
        for name in names:
            where = source.where(name)
            rollouts += _of_file(h5py, where, source.read(name), ids[name], chosen, source.limits)
    if not rollouts:
        raise BadInput(place, f"HDF5 files ({', '.join(ENDINGS)})", "none")
    return rollouts


def _of_file(
    h5py: Any, where: str, content: bytes, rollout_id: str, chosen: ColumnMap, limits: Limits
) -> list[Rollout]:
    try:
        with h5py.File(io.BytesIO(content), "r") as file:
            groups = _groups(h5py, where, file, chosen.episode, limits)
            return [
                rollout
                for name, group in groups
                for rollout in _of_group(
                    h5py, where, group, f"{rollout_id}_{name}" if name else rollout_id, chosen, limits
                )
            ]
    except BadInput:
        raise
    except Exception as error:  # h5py raises OSError, KeyError, RuntimeError, ValueError and more of a damaged file
        raise BadInput(where, "an HDF5 file", f"{type(error).__name__}: {error}"[:200]) from None


def _groups(h5py: Any, where: str, file: Any, pattern: str, limits: Limits) -> list[tuple[str, Any]]:
    """Name and group of each episode; the file itself where the map names none. `*` stands for a part of one name."""
    if not pattern:
        return [("", file)]
    parent, _, last = pattern.strip("/").rpartition("/")
    base = _at(h5py, f"{where}: {parent}", file, parent)
    found = sorted((name for name in base if fnmatch.fnmatchcase(name, last)), key=_by_number)
    if not found or len(found) > limits.members:
        raise BadInput(f"{where}: {pattern}", "groups of an episode each", f"{len(found):,} of {len(base):,} names")
    return [(name, _at(h5py, f"{where}: {parent}/{name}", base, name)) for name in found]


def _by_number(name: str) -> tuple[str, int, str]:
    """So that demo_10 comes after demo_9."""
    stem = name.rstrip("0123456789")
    digits = name[len(stem) :][:18]
    return stem, int(digits or 0), name


def _at(h5py: Any, where: str, group: Any, path: str) -> Any:
    """Object at a path in a group, every step of which is a plain link within this file."""
    for part in filter(None, path.split("/")):
        link = group.get(part, getlink=True) if isinstance(group, h5py.Group) else None
        if link is None:
            names = ", ".join(list(group)[:40]) if isinstance(group, h5py.Group) else "a data set"
            raise BadInput(where, f"{part}, as the map says", f"only {names or 'nothing'}"[:300])
        if isinstance(link, h5py.ExternalLink | h5py.SoftLink):
            raise BadInput(where, "data in the file itself", "a link that leads elsewhere")
        group = group[part]
    return group


def _of_group(h5py: Any, where: str, group: Any, rollout_id: str, chosen: ColumnMap, limits: Limits) -> list[Rollout]:
    values = {}
    for column, names in chosen.columns.items():
        width = chosen.width(column)
        parts = [_array(h5py, f"{where}: {name}", group, name, limits) for name in names]
        values[column] = _joined(f"{where}: {names[0]}", parts, width)
    rows = {column: len(value) for column, value in values.items()}
    if chosen.hz:
        time = np.arange(rows["joint_pos"]) / chosen.hz
    else:
        stamps = [_array(h5py, f"{where}: {name}", group, name, limits).ravel() for name in chosen.time]
        time = stamps[0] * SECONDS[chosen.time_unit]
        if len(stamps) > 1:
            time = _joined(f"{where}: {chosen.time[0]}", stamps, 2) @ [1.0, SECONDS["ns"]]
    for column, count in rows.items():
        if count != len(time):
            raise BadInput(f"{where}: {chosen.columns[column][0]}", f"{len(time)} rows, one a stamp", f"{count}")
    if not len(time):
        raise BadInput(where, "rows", "none")
    return rollouts_of(where, rollout_id, time, values, chosen)


def _array(h5py: Any, where: str, group: Any, path: str, limits: Limits) -> np.ndarray:
    """A data set of numbers, after a look at how much it says it holds."""
    data = _at(h5py, where, group, path)
    if not isinstance(data, h5py.Dataset) or data.shape is None:
        raise BadInput(where, "a data set", "a group or an empty one")
    if data.external is not None or data.is_virtual:
        raise BadInput(where, "data in the file itself", "storage that lies elsewhere")
    if data.dtype.kind not in "biuf":
        raise BadInput(where, "real numbers", str(data.dtype)[:60])
    size, piece = (_CELL * int(np.prod([float(n) for n in shape])) for shape in (data.shape, data.chunks or (1,)))
    if max(size, piece) > limits.unpacked_bytes:
        raise BadInput(where, f"at most {limits.unpacked_bytes:,} bytes", f"{max(size, piece):,}")
    return require_real(where, np.asarray(data[()]))


def _joined(where: str, parts: list[np.ndarray], width: int) -> np.ndarray:
    """(T, width) of one data set, or of one for each element."""
    if len(parts) == 1 and parts[0].ndim == 2 and parts[0].shape[1] == width:
        return parts[0]
    flat = [part.ravel() for part in parts if part.size == len(part)] if all(p.ndim for p in parts) else []
    if len(flat) != width or len({len(part) for part in flat}) != 1:
        came = ", ".join(str(part.shape) for part in parts[:6])
        raise BadInput(where, f"a data set of {width} columns, or {width} of one each and equally many rows", came)
    return np.stack(flat, axis=1)
