"""Reads G1 motions in the field's CSV layout: root xyz [m], root quaternion xyzw, 29 or 23 joint angles [rad].

There is no frame rate in such a file: LAFAN1's retargets have 30 Hz, g1_moves 60 Hz.
"""

from pathlib import Path

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.io.read import read_bytes
from bumblebee.motion.checks import MAX_FRAMES
from bumblebee.motion.raw import RawMotion
from bumblebee.robot.facts import WRIST_JOINTS, joint_names

MAX_BYTES = 256 << 20  # an hour at 60 Hz has 80 MB
_BLOCK = 10_000  # rows that are split into cells at a time
_ROOT = 7
_WIDTHS = {_ROOT + dof: joint_names(dof) for dof in (29, 23)}


def read_g1_csv(path: Path, fps: float, data: bytes | None = None) -> RawMotion:
    """One motion; a header row, where there is one, names the joints in their order.

    Args:
        path: the file.
        fps: its frame rate [Hz].
        data: its bytes, where they have been read.
    """
    lines = _lines(path, read_bytes(path, MAX_BYTES) if data is None else data)
    width = lines[0].count(",") + 1
    if width > max(_WIDTHS):  # before anything is split: a line may have a hundred million commas
        raise _width(path, 1, width)
    header = _header(path, lines[0])
    first_row = 2 if header else 1
    joints = header or _WIDTHS.get(width)
    if joints is None:
        raise _width(path, 1, width)
    values = _numbers(path, lines[first_row - 1 :], first_row, _ROOT + len(joints))
    order = [_ROOT + joints.index(name) for name in joint_names()]
    return RawMotion(path.stem, float(fps), values[:, :3], values[:, [6, 3, 4, 5]], values[:, order], path, first_row)


def _lines(path: Path, data: bytes) -> list[str]:
    if len(data) > MAX_BYTES:
        raise BadInput(path, f"at most {MAX_BYTES:,} bytes of CSV", f"{len(data):,}")
    try:
        lines = data.decode("utf-8-sig").splitlines()
    except UnicodeDecodeError:
        raise BadInput(path, "a CSV text file", "bytes that are no text") from None
    while lines and not lines[-1].strip():
        lines.pop()
    if not lines:
        raise BadInput(path, "a CSV file of 36 columns", "an empty file", "Copy the file again.")
    if len(lines) > MAX_FRAMES:
        raise BadInput(path, f"at most {MAX_FRAMES:,} rows", f"{len(lines):,}")
    return lines


def _header(path: Path, line: str) -> tuple[str, ...] | None:
    """Joint names of a header row in full (`left_knee_joint`), or None if the first row holds numbers."""
    cells = [cell.strip().strip('"') for cell in line.split(",")]
    if all(_is_number(cell) for cell in cells):
        return None
    if any(_is_number(cell) for cell in cells):
        column = next(i for i, cell in enumerate(cells, 1) if not _is_number(cell))
        raise BadInput(f"{path}, row 1, column {column}", "a number", repr(cells[column - 1][:80])[:60])
    names = []
    for column, cell in enumerate(cells[_ROOT:], _ROOT + 1):
        name = cell.lower().removesuffix("_dof").removesuffix("_joint") + "_joint"
        if name not in joint_names(29):
            raise BadInput(f"{path}, row 1, column {column}", "the name of a G1 joint", f"unknown joint {cell[:60]!r}")
        names.append(name)
    missing = [name for name in joint_names() if name not in names]
    if missing or len(set(names)) != len(names):
        came = f"none for {missing[0]}" if missing else "one joint twice"
        wanted = f"7 root columns, then one for each of the 23 joints (the {len(WRIST_JOINTS)} wrist joints may follow)"
        raise BadInput(f"{path}, row 1", wanted, came)
    return tuple(names)


def _numbers(path: Path, lines: list[str], first_row: int, width: int) -> np.ndarray:
    """The table (T, width); a bad row or cell is named by its number as an editor shows it."""
    for row, line in enumerate(lines, first_row):
        if (came := line.count(",") + 1) != width:
            raise _width(path, row, came) if first_row == 1 and row == 1 else _ragged(path, row, width, came)
    values = np.empty((len(lines), width))
    for start in range(0, len(lines), _BLOCK):
        values[start : start + _BLOCK] = _block(path, lines[start : start + _BLOCK], first_row + start, width)
    return values


def _block(path: Path, lines: list[str], first_row: int, width: int) -> np.ndarray:
    cells = [line.split(",") for line in lines]
    try:
        if not any("_" in line for line in lines):  # Python reads 1_0 as ten; no CSV means that
            return np.array(cells, dtype=np.float64).reshape(-1, width)
    except ValueError:
        pass
    row, column = next((r, c) for r, line in enumerate(cells) for c, cell in enumerate(line) if not _is_number(cell))
    where = f"{path}, row {row + first_row}, column {column + 1}"
    raise BadInput(where, "a number", repr(cells[row][column][:80])[:60])


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return "_" not in cell


def _width(path: Path, row: int, came: int) -> BadInput:
    wanted = "36 columns (xyz, quaternion xyzw, 29 joints), or 30 with 23 joints"
    return BadInput(f"{path}, row {row}", wanted, f"{came} column{'s' * (came != 1)}")


def _ragged(path: Path, row: int, width: int, came: int) -> BadInput:
    return BadInput(f"{path}, row {row}", f"{width} columns like the rows before", str(came), "Copy the file again.")
