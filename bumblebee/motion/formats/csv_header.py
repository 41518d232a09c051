"""Layout of a CSV file by its first row: which columns are the root, which the joints, in which units and orders.

Three layouts are known. Without a header: Unitree's (LAFAN1's retargets, g1_moves), xyz [m], quaternion xyzw, 29 or 23
joints [rad]. With a header and a quaternion: the same units; names that end in w, x, y, z give its order. With a header
and Euler angles: that of NVIDIA's SOMA retargeter, in which BONES-SEED is published, has `Frame`, `root_translateX/Y/Z`
[cm], `root_rotateX/Y/Z` [degrees, about the world's x, then y, then z] and `<joint>_dof` [degrees]; for other names the
units and the order must be set.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

from bumblebee.errors import BadInput
from bumblebee.motion.formats.config import RobotConfig
from bumblebee.motion.formats.layouts import layout_of, notes_of, require_joints, sizes
from bumblebee.motion.raw import is_order
from bumblebee.motion.reading.remedy import say
from bumblebee.robot.facts import joint_names

_QUATERNION, _EULER = 7, 6  # columns of the root
_TIME = "time"
_COUNTERS = ("frame", "frame_id", "frame_index", "index", _TIME)
_SOMA = tuple(f"root_{what}{axis}" for what in ("translate", "rotate") for axis in "xyz")
_METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001}
UNITS = say({"csv_length": "cm", "csv_angle": "deg", "csv_euler": "xyz"})


@dataclass(frozen=True)
class CsvLayout:
    """Where a motion's columns are, counted from 0, and what they mean."""

    position: tuple[int, ...]
    """Columns of x, y, z."""
    rotation: tuple[int, ...]
    """Columns of the root's rotation: a quaternion in `quat_order`, or Euler angles about x, y, z."""
    first_joint: int
    """Column of the first joint; the others follow."""
    names: tuple[str, ...]
    """The joints in the order of their columns."""
    width: int
    counter: int | None = None
    """Column that numbers or times the frames."""
    metres: float = 1.0
    """Length of a unit of the position [m]."""
    degrees: bool = False
    euler: str = ""
    """Order of the Euler angles, "" for a quaternion."""
    quat_order: str = "xyzw"
    order_from: Literal["", "file", "known"] = ""
    """Who says the quaternion's order; "": nobody."""
    stated: bool = True
    """Whether units and order are what the file or the user says, not what files of this layout usually have."""
    seconds: bool = False
    """Whether the counter holds times."""

    @property
    def unit(self) -> str:
        """Unit of the position."""
        return next(name for name, metres in _METRES.items() if metres == self.metres)

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes on how the file is read."""
        if not self.euler:
            return notes_of(self.names)
        why = "as set" if self.stated else "as the SOMA retargeter writes (BONES-SEED)"
        said = f"{self.unit}, {'degrees' if self.degrees else 'radians'}, Euler angles {self.euler}: {why}"
        return (said, *notes_of(self.names))


def bare_layout(where: object, width: int, options: RobotConfig) -> CsvLayout:
    """The layout of a file without a header, by its number of columns."""
    for dof in sizes():
        if width == _QUATERNION + dof:
            names = layout_of(where, dof, options.joints_23)
            return CsvLayout((0, 1, 2), (3, 4, 5, 6), _QUATERNION, names, width, **_order("", options))
    wanted = " or ".join(f"{_QUATERNION + n} columns (xyz, quaternion xyzw, {n} joints)" for n in sizes())
    raise BadInput(where, wanted, f"{width} column{'s' * (width != 1)}")


def header_layout(path: Path, cells: list[str], options: RobotConfig) -> CsvLayout:
    """The layout that the names in the first row say.

    Args:
        path: the file.
        cells: the names.
        options: units and orders where the names do not say them.
    """
    timed = cells[0].strip().strip('"').lower() == _TIME
    return replace(_named_layout(path, cells, options), seconds=timed)


def _named_layout(path: Path, cells: list[str], options: RobotConfig) -> CsvLayout:
    names = [cell.strip().strip('"').lower() for cell in cells]
    first = next((column for column, name in enumerate(names) if _joint(name) in joint_names(every=True)), len(names))
    counter = 0 if names[0] in _COUNTERS else None
    start = 0 if counter is None else 1
    joints = _joints(path, cells, first)
    if first - start == _QUATERNION:
        position, rotation = _position(path, names, start), tuple(range(start + 3, start + 7))
        last = "".join(name[-1:] for name in names[start + 3 : start + 7])
        return CsvLayout(position, rotation, first, joints, len(cells), counter, **_order(last, options))
    if first - start == _EULER:
        return _euler(path, names, start, (first, joints, len(cells), counter), options)
    wanted = "before the joints' columns 3 of the root's position and 4 of its quaternion or 3 Euler angles"
    raise BadInput(f"{path}, row 1", wanted, f"{first - start} columns")


def _order(last: str, options: RobotConfig) -> dict[str, Any]:
    """The quaternion's order: as set, by the last letters of its names, or xyzw, which nobody says."""
    if options.quaternion:
        return {"quat_order": options.quaternion, "order_from": "known"}
    return {"quat_order": last, "order_from": "file"} if is_order(last) else {}


def _euler(
    path: Path,
    names: list[str],
    start: int,
    rest: tuple[int, tuple[str, ...], int, int | None],
    options: RobotConfig,
) -> CsvLayout:
    soma = tuple(names[start : start + 6]) == _SOMA
    length, angle, order = options.csv_length, options.csv_angle, options.csv_euler
    if not soma and not (length and angle and order):
        missing = [word for word, said in (("length", length), ("angle", angle), ("Euler order", order)) if not said]
        came = f"{', '.join(names[start : start + 6])}"[:160] + f", which say no {' and no '.join(missing)}"
        raise BadInput(f"{path}, row 1", "units and order of the Euler angles", came, UNITS)
    position = _position(path, names, start)
    rotation = tuple(start + 3 + column for column in _axes(path, names[start + 3 : start + 6], start + 4))
    stated = bool(length and angle and order)
    euler = order or "xyz"
    return CsvLayout(
        position, rotation, *rest, _METRES[length or "cm"], (angle or "deg") == "deg", euler, "wxyz", "known", stated
    )


def _joint(name: str) -> str:
    """The joint that a column is named after, whatever its case, with or without `_joint` and `_dof`; else its name."""
    stem = name.removesuffix("_dof").removesuffix("_joint")
    known = {joint.lower(): joint for joint in joint_names(every=True)}
    return next((known[own] for own in (name, stem, f"{stem}_joint") if own in known), f"{stem}_joint")


def _joints(path: Path, cells: list[str], first: int) -> tuple[str, ...]:
    """The joints in the order of their columns; every column from the first joint on must be one."""
    names = tuple(_joint(cell.strip().strip('"').lower()) for cell in cells[first:])
    require_joints(f"{path}, row 1", names, "column", first + 1)
    return names


def _position(path: Path, names: list[str], start: int) -> tuple[int, ...]:
    return tuple(start + column for column in _axes(path, names[start : start + 3], start + 1))


def _axes(path: Path, names: list[str], column: int) -> list[int]:
    """Places of x, y, z among three names that end in these letters; names without them are in that order."""
    last = [name[-1:] for name in names]
    if sorted(last) == ["x", "y", "z"]:
        return [last.index(axis) for axis in "xyz"]
    if not set(last) & {"x", "y", "z"}:
        return [0, 1, 2]
    raise BadInput(f"{path}, row 1, column {column}", "names that end in x, y and z", ", ".join(names)[:120])
