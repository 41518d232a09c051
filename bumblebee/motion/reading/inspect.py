"""A table of what lies at a path: each motion with its format, rate, length, height, captions, licence and problems."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.io.names import safe_stem
from bumblebee.motion.clip import Clip
from bumblebee.motion.describe.describer import beside
from bumblebee.motion.formats.read import format_of
from bumblebee.motion.human.motion import HumanMotion, Role
from bumblebee.motion.raw import RawMotion
from bumblebee.motion.reading.file import File, Motion, reason_of
from bumblebee.motion.reading.files import find_motions
from bumblebee.motion.reading.naming import Names
from bumblebee.motion.reading.one_file import FileConfig
from bumblebee.motion.reading.usable import usable


@dataclass(frozen=True)
class Inspected:
    """One motion, or a file without any (no `name`, and a `problem`)."""

    file: Path
    format: str
    name: str = ""
    frames: int = 0
    fps: float = 0.0
    rate_from: str = ""
    """Who says the rate: file, setting or library."""
    height: tuple[float, float] = (0.0, 0.0)
    """Height of the root, lowest and highest [m]."""
    joints: int = 0
    """Joints of the robot; 0 for a person."""
    captions: int = 0
    licence: str = ""
    notes: tuple[str, ...] = ()
    problem: str = ""
    """Why the file or the motion cannot be used, "" if it can."""
    skeleton: tuple[Role, ...] = ()
    """Which joint of a BVH file is which landmark, as far as it is known."""

    @property
    def seconds(self) -> float:
        """From the first frame to the last."""
        return max(self.frames - 1, 0) / self.fps if self.fps else 0.0


@dataclass
class Counts:
    """Files and motions, which add up."""

    files: int = 0
    unreadable: int = 0
    """Files without a motion."""
    motions: int = 0
    faulty: int = 0
    """Motions that were read and failed a check."""
    seconds: float = 0.0
    """Duration of the motions that are usable [s]."""

    def add(self, rows: list[Inspected]) -> None:
        """Count the rows of one file."""
        self.files += 1
        motions = [row for row in rows if row.name]
        self.unreadable += not motions
        self.motions += len(motions)
        self.faulty += sum(bool(row.problem) for row in motions)
        self.seconds += sum(row.seconds for row in motions if not row.problem)

    @property
    def usable(self) -> int:
        """Motions without a problem."""
        return self.motions - self.faulty

    def __str__(self) -> str:
        read = self.files - self.unreadable
        return (
            f"{count(self.files, 'file')}: {read} read, {self.unreadable} not. {count(self.motions, 'motion')}: "
            f"{self.usable} usable ({self.seconds:.0f} s), {self.faulty} with a problem."
        )


def inspect(path: Path, config: FileConfig | None = None) -> Iterator[list[Inspected]]:
    """The rows of each file at or below `path`.

    Args:
        path: a file, a folder or a motion library.
        config: what files may leave unsaid.
    """
    names = Names()
    for found in find_motions(path, config):
        yield [_named(row, names) for row in rows_of(found)]


def _named(row: Inspected, names: Names) -> Inspected:
    """The row with the name by which `play`, `view` and `convert` know its motion."""
    if not row.name or row.problem:
        return row
    return replace(row, name=names.distinct(safe_stem(row.name, "motion"), row.file.parent.name))


def rows_of(found: File) -> list[Inspected]:
    """A row for each motion of a file; one with the reason where there is none."""
    if not found.motions:
        reason = found.reason or "no motion in it"
        return [Inspected(found.path, format_of(found.path), problem=reason, skeleton=found.skeleton)]
    return [_row(found, motion) for motion in found.motions]


def _row(found: File, motion: Motion) -> Inspected:
    path = found.path
    if isinstance(motion, Clip):
        return Inspected(
            path, "library", motion.name, motion.frames, motion.fps, "library", _range(motion.root_pos[:, 2]),
            motion.joint_pos.shape[1], len(motion.captions), motion.licence,
        )  # fmt: skip
    problem, notes, skeleton = "", motion.notes, tuple[Role, ...]()
    if isinstance(motion, HumanMotion):
        kind, root = f"person {path.suffix.lower()}", motion.landmark("pelvis")
        joints, rate, skeleton = 0, "file", motion.skeleton
    else:
        kind, root, joints, rate = format_of(path), motion.root_pos, motion.joint_pos.shape[1], motion.rate_from
        problem, notes = _judged(path, motion)
    texts = beside(motion.file, (len(root) - 1) / motion.fps)
    return Inspected(
        path, kind, motion.name, len(root), motion.fps, rate, _range(root[:, 2]), joints,
        len(texts.captions), found.licence, (*notes, *texts.notes), problem, skeleton,
    )  # fmt: skip


def _judged(path: Path, motion: RawMotion) -> tuple[str, tuple[str, ...]]:
    """The check that a motion of the robot fails, "" if none, and the notes on it."""
    try:
        return "", usable(motion).notes
    except BadInput as error:
        return reason_of(error, path), motion.notes


def _range(height: np.ndarray) -> tuple[float, float]:
    height = height[np.isfinite(height)]
    return (float(height.min()), float(height.max())) if len(height) else (np.nan, np.nan)


def count(number: int, word: str) -> str:
    """A number with its word, in the plural where there are several."""
    return f"{number:,} {word}{'s' * (number != 1)}"
