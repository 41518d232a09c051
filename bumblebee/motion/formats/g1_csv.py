"""Reads G1 motions from CSV files: the field's layout without a header, and those whose header says what they hold.

There is no frame rate in such a file: LAFAN1's retargets have 30 Hz, g1_moves 60 Hz, BONES-SEED 120 Hz.
"""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from bumblebee.errors import BadInput
from bumblebee.io.read import read_bytes
from bumblebee.motion.checks import MAX_FRAMES
from bumblebee.motion.formats.config import RobotConfig
from bumblebee.motion.formats.csv_header import CsvLayout, bare_layout, header_layout
from bumblebee.motion.formats.layouts import arranged
from bumblebee.motion.raw import RawMotion, as_wxyz
from bumblebee.motion.reading.remedy import say

MAX_BYTES = 256 << 20  # an hour at 60 Hz has 80 MB
_BLOCK = 10_000  # rows that are split into cells at a time
_WIDEST = 1 + 7 + 29  # columns of any layout
_TURN = 6.5  # joint angles of a moving robot are larger in degrees, smaller in radians
_LOW, _HIGH = 0.03, 5.0  # m: the pelvis in the median, lying down or standing


def read_g1_csv(path: Path, fps: float, data: bytes | None = None, options: RobotConfig | None = None) -> RawMotion:
    """One motion.

    Args:
        path: the file.
        fps: its frame rate [Hz].
        data: its bytes, where they have been read.
        options: units and Euler order for headers that do not say them.
    """
    options = options or RobotConfig()
    lines = _lines(path, read_bytes(path, MAX_BYTES) if data is None else data)
    width = lines[0].count(",") + 1
    if width > _WIDEST:  # before anything is split: a line may have a hundred million commas
        bare_layout(f"{path}, row 1", width, options)
    cells = _header(path, lines[0])
    layout = header_layout(path, cells, options) if cells else bare_layout(f"{path}, row 1", width, options)
    first_row = 2 if cells else 1
    values = _numbers(path, lines[first_row - 1 :], first_row, layout.width)
    if layout.counter is not None:
        _counted(path, values[:, layout.counter], first_row, layout.seconds)
    if layout.euler and not layout.stated:
        _units_hold(path, values, layout)
    angle = np.pi / 180 if layout.degrees else 1.0
    return RawMotion(
        path.stem,
        float(fps),
        values[:, layout.position] * layout.metres,
        _rotation(values, layout),
        arranged(values[:, layout.first_joint :], layout.names) * angle,
        path,
        first_row,
        notes=layout.notes,
        rate_from="setting",
        quat_order=layout.quat_order,
        order_from=layout.order_from,
    )


def _rotation(values: np.ndarray, layout: CsvLayout) -> np.ndarray:
    """The root's quaternions (T, 4) [wxyz]; not a number where an angle is none."""
    rotation = values[:, layout.rotation]
    if not layout.euler:
        return as_wxyz(rotation, layout.quat_order)
    finite = np.isfinite(rotation).all(axis=1)
    quat = np.full((len(values), 4), np.nan)
    angles = rotation[:, ["xyz".index(axis) for axis in layout.euler.lower()]][finite]
    if len(angles):
        turned = Rotation.from_euler(layout.euler, angles, degrees=layout.degrees)
        quat[finite] = turned.as_quat()[:, [3, 0, 1, 2]]
    return quat


def _counted(path: Path, numbers: np.ndarray, first_row: int, seconds: bool) -> None:
    """A file that numbers or times its frames has all of them."""
    steps = np.diff(numbers)
    even = float(np.median(steps)) if seconds and len(steps) else 1.0
    jumps = np.flatnonzero(np.abs(steps - even) > (0.5 * even if seconds else 0))
    if len(jumps):
        row, before = int(jumps[0]) + 1, numbers[jumps[0]]
        where = f"{path}, row {row + first_row}, {'time' if seconds else 'frame number'}"
        raise BadInput(where, f"{before + even:g}, the next", f"{numbers[row]:g}", "Copy or export the file again.")


def _units_hold(path: Path, values: np.ndarray, layout: CsvLayout) -> None:
    """Centimetres and degrees, which the layout has and the file does not say, must fit to its numbers."""
    values = values[np.isfinite(values).all(axis=1)]
    if not len(values):
        return  # the checks of every motion name the cell
    height = float(np.median(values[:, layout.position[2]]))
    if not _LOW <= abs(height) * layout.metres <= _HIGH:
        remedy = f"Other units? {say({'csv_length': 'm', 'csv_angle': 'deg', 'csv_euler': 'xyz'})}"
        raise BadInput(f"{path}, root height", f"{layout.unit}", f"{height:.4g} in the median", remedy)
    angle = float(np.abs(values[:, layout.first_joint :]).max())
    if layout.degrees and angle < _TURN:
        remedy = f"Radians? {say({'csv_length': 'cm', 'csv_angle': 'rad', 'csv_euler': 'xyz'})}"
        raise BadInput(f"{path}, joint angles", "degrees", f"none above {angle:.3g}", remedy)


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


def _header(path: Path, line: str) -> list[str] | None:
    """The cells of a header row, or None if the first row holds numbers."""
    cells = [cell.strip().strip('"') for cell in line.split(",")]
    if all(_is_number(cell) for cell in cells):
        return None
    if any(_is_number(cell) for cell in cells):
        column = next(i for i, cell in enumerate(cells, 1) if not _is_number(cell))
        raise BadInput(f"{path}, row 1, column {column}", "a number", repr(cells[column - 1][:80])[:60])
    return cells


def _numbers(path: Path, lines: list[str], first_row: int, width: int) -> np.ndarray:
    """The table (T, width); a bad row or cell is named by its number as an editor shows it."""
    for row, line in enumerate(lines, first_row):
        if (came := line.count(",") + 1) != width:
            raise _ragged(path, row, width, came)
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


def _ragged(path: Path, row: int, width: int, came: int) -> BadInput:
    return BadInput(f"{path}, row {row}", f"{width} columns like the rows before", str(came), "Copy the file again.")
