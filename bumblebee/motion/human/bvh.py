"""Reads BVH: a hierarchy of joints with offsets and channels, then one row of numbers for each frame.

Any order of channels, 3 or 6 (or any others) for a joint, positions in any joint. Nothing is made of units and axes
here: BVH states neither.
"""

import re
import warnings
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.io.read import decode
from bumblebee.motion.texts import shown

MAX_BYTES = 256 << 20  # an hour of 31 joints at 120 Hz has 320 MB: such a file is split
MAX_FRAMES = 500_000  # of one motion of a person: 69 minutes at 120 Hz
_MAX_JOINTS = 1000
_MAX_HEADER = 1 << 20  # characters; 31 joints have 5,000
_CHANNELS = {f"{axis}{kind}": (kind, "xyz".index(axis)) for axis in "xyz" for kind in ("position", "rotation")}
_LARGEST = 1e7  # of a number: 10 km in millimetres
_AGAIN = "Export or copy the file again."


@dataclass(frozen=True, eq=False)
class Bvh:
    """Content of a BVH file: joints and the ends of chains, parents before children, and the channels' values.

    `offsets` (J, 3) in the file's unit, `values` (T, C) in the file's unit and degrees.
    """

    names: tuple[str, ...]
    """An end of a chain has the name of its parent and `/end`."""
    parents: tuple[int, ...]
    """Index of each joint's parent; -1 for the root."""
    offsets: np.ndarray
    channels: tuple[tuple[tuple[str, int], ...], ...]
    """For each joint its channels in their order: (`position` or `rotation`, axis 0 to 2)."""
    fps: float
    values: np.ndarray
    notes: tuple[str, ...] = ()

    @property
    def first_channel(self) -> list[int]:
        """The column of each joint's first channel."""
        return [0, *np.cumsum([len(own) for own in self.channels])[:-1].tolist()]


@dataclass
class _Joints:
    """The hierarchy as far as it has been read."""

    names: list[str] = field(default_factory=list)
    parents: list[int] = field(default_factory=list)
    offsets: list[tuple[float, ...] | None] = field(default_factory=list)
    channels: list[tuple[tuple[str, int], ...] | None] = field(default_factory=list)


def parse_bvh(path: Path, data: bytes) -> Bvh:
    """The file's content.

    Raises:
        BadInput: with the line of what is wrong in the hierarchy, the frame of what is wrong in the motion.
    """
    if len(data) > MAX_BYTES:
        raise BadInput(path, f"at most {MAX_BYTES:,} bytes of BVH", f"{len(data):,}", "Split the file.")
    lines = decode(path, data).splitlines()
    start = next((i for i, line in enumerate(lines) if line.strip().upper() == "MOTION"), None)
    if not lines or lines[0].strip().upper() != "HIERARCHY" or start is None:
        came = "no line MOTION" if lines and lines[0].strip().upper() == "HIERARCHY" else "another beginning"
        raise BadInput(path, "BVH: a line HIERARCHY, the joints, a line MOTION, the frames", came, _AGAIN)
    joints = _hierarchy(path, lines[1:start])
    columns = sum(len(own or ()) for own in joints.channels)
    frames, fps = _head(path, lines, start + 1)
    values = _table(path, lines[start + 3 :], frames, columns)
    return Bvh(
        tuple(joints.names),
        tuple(joints.parents),
        np.array(joints.offsets, dtype=np.float64),
        tuple(own or () for own in joints.channels),
        fps,
        values,
        (f"Frames: says {frames:,}, all {len(values):,} rows are read",) if len(values) != frames else (),
    )


def _hierarchy(path: Path, lines: list[str]) -> _Joints:
    if sum(map(len, lines)) > _MAX_HEADER:
        raise BadInput(path, f"a hierarchy of at most {_MAX_HEADER:,} characters", "a longer one")
    joints, closed = _Joints(), False
    chain: list[int] = []
    for number, line in enumerate(lines, 2):
        for words in _statements(line):
            where = f"{path}, line {number}"
            key = words[0].upper()
            if closed:
                raise BadInput(where, "one ROOT, then MOTION", shown(" ".join(words), 40), "Keep one person a file.")
            if key in ("ROOT", "JOINT", "END"):
                _add(where, joints, chain, key, words)
            elif key == "}":
                _close(where, joints, chain)
                closed = not chain
            elif key in ("OFFSET", "CHANNELS") and chain:
                _set(where, joints, chain[-1], key, words[1:])
            elif key != "{":
                raise BadInput(where, "ROOT, JOINT, End Site, OFFSET, CHANNELS or a brace", repr(shown(words[0], 40)))
    if not closed:
        raise BadInput(path, "a hierarchy that closes as many braces as it opens", "an open one", _AGAIN)
    return joints


def _statements(line: str) -> list[list[str]]:
    """The words of each statement of a line; a brace is one of its own."""
    parts = re.split(r"([{}])", line)
    return [words for part in parts if (words := part.split())]


def _add(where: str, joints: _Joints, chain: list[int], key: str, words: list[str]) -> None:
    if (key == "ROOT") == bool(chain):
        raise BadInput(where, "a JOINT or End Site within the one ROOT", key)
    if len(joints.names) >= _MAX_JOINTS:
        raise BadInput(where, f"at most {_MAX_JOINTS:,} joints", "more")
    name = f"{joints.names[chain[-1]]}/end" if key == "END" else shown(" ".join(words[1:]), 80)
    if not name:
        raise BadInput(where, f"{key} and a name", "no name")
    joints.parents.append(chain[-1] if chain else -1)
    chain.append(len(joints.names))
    joints.names.append(name)
    joints.offsets.append(None)
    joints.channels.append(() if key == "END" else None)


def _close(where: str, joints: _Joints, chain: list[int]) -> None:
    if not chain:
        raise BadInput(where, "a hierarchy that closes as many braces as it opens", "one too many")
    joint = chain.pop()
    if joints.offsets[joint] is None or joints.channels[joint] is None:
        lacks = "OFFSET" if joints.offsets[joint] is None else "CHANNELS"
        raise BadInput(f"{where}, joint {joints.names[joint]}", f"its {lacks} before its brace closes", "none", _AGAIN)


def _set(where: str, joints: _Joints, joint: int, key: str, words: list[str]) -> None:
    where = f"{where}, joint {joints.names[joint]}"
    if key == "OFFSET":
        values = [_number(word) for word in words]
        if len(values) != 3 or not all(value is not None and _fits(value) for value in values):
            hint = " (with commas for decimal points)" if any("," in word for word in words) else ""
            raise BadInput(where, "OFFSET and three finite numbers", shown(" ".join(words), 60) + hint, _AGAIN)
        joints.offsets[joint] = tuple(float(value) for value in values if value is not None)
        return
    named = [word.lower() for word in words[1:]]
    if not words or not words[0].isascii() or words[0] != str(len(named)):
        came = f"{shown(words[0], 20) if words else 'none'} and {len(named)} names"
        raise BadInput(where, "CHANNELS, their number and as many names", came, _AGAIN)
    if len(set(named)) != len(named) or not set(named) <= set(_CHANNELS):
        raise BadInput(where, "each of Xposition ... Zrotation once at most", shown(" ".join(words[1:]), 80))
    joints.channels[joint] = tuple(_CHANNELS[name] for name in named)


def _head(path: Path, lines: list[str], at: int) -> tuple[int, float]:
    """The number of frames and their rate [Hz]."""
    said = []
    for number, (key, wanted) in enumerate((("Frames:", "a whole number"), ("Frame Time:", "seconds")), at):
        line = " ".join(lines[number].split()) if number < len(lines) else ""
        if not line.lower().startswith(key.lower()):
            raise BadInput(f"{path}, line {number + 1}", f"{key} and {wanted}", repr(shown(line, 40)), _AGAIN)
        said.append(line[len(key) :].strip())
    if not (said[0].isascii() and said[0].isdigit() and 1 <= int(said[0][:12]) <= MAX_FRAMES):
        raise BadInput(f"{path}, Frames:", f"1 to {MAX_FRAMES:,}", shown(said[0], 20) or "nothing")
    seconds = _number(said[1])
    if seconds is None or not 1e-3 <= seconds <= 1:
        hint = " (a comma for the decimal point)" if "," in said[1] else ""
        raise BadInput(f"{path}, Frame Time:", "0.001 to 1 s", (shown(said[1], 20) or "nothing") + hint)
    return int(said[0]), rate(said[1])


def rate(text: str) -> float:
    """Frames a second of a frame time as it is written: .0083333 is 120 Hz, 0.0333667 29.97 Hz.

    The nearest whole rate is meant where its frame time, cut to as many decimals, is the one that is written.
    """
    seconds = float(text)
    whole = round(1 / seconds)
    decimals = len(text.partition(".")[2]) if "e" not in text.lower() else 15
    return float(whole) if abs(1 / whole - seconds) < 10.0**-decimals else 1 / seconds


def _table(path: Path, lines: list[str], frames: int, columns: int) -> np.ndarray:
    """All rows, (T, columns): as many as the file says, or more."""
    while lines and not lines[-1].strip():
        lines.pop()
    if columns == 0:
        raise BadInput(path, "channels in the hierarchy", "none")
    if frames <= len(lines) <= MAX_FRAMES:
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                values = np.loadtxt(lines, dtype=np.float64, comments=None, ndmin=2)
            if values.shape == (len(lines), columns) and (np.abs(values) <= _LARGEST).all():
                return values
        except ValueError:
            pass
    raise _wrong_row(path, lines, frames, columns)


def _wrong_row(path: Path, lines: list[str], frames: int, columns: int) -> BadInput:
    """Error for the first row that is wrong."""
    for number, line in enumerate(lines, 1):
        words = line.split()
        where = f"{path}, frame {number}"
        for column, word in enumerate(words, 1):
            value = _number(word)
            if value is None or not _fits(value):
                hint = "Decimal points must be points, not commas." if "," in word else ""
                return BadInput(f"{where}, value {column}", f"a number up to {_LARGEST:g}", repr(shown(word, 40)), hint)
        if len(words) != columns:
            return BadInput(where, f"{columns} values, as many as channels", str(len(words)), _AGAIN)
    wanted = f"{frames:,} frames or more, as its line Frames: says, {MAX_FRAMES:,} at most"
    return BadInput(path, wanted, f"{len(lines):,}", "Copy the file again, or split it.")


def _fits(value: float) -> bool:
    """Whether a number is finite and not too large; NaN is not."""
    return abs(value) <= _LARGEST


def _number(word: str) -> float | None:
    """A number as BVH writes it: what Python alone accepts (1_0, other scripts' digits) is none."""
    if not word.isascii() or "_" in word:
        return None
    try:
        return float(word)
    except ValueError:
        return None
