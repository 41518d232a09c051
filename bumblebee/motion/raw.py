"""A motion as its file holds it, before anything is made of it."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np


@dataclass(frozen=True)
class RawMotion:
    """What a reader returns: arrays at the file's own rate, float64.

    `root_pos` (T, 3) [m, world], `root_quat` (T, 4) [wxyz as read, of any length or sign], `joint_pos` (T, 23) [rad].
    """

    name: str
    fps: float
    root_pos: np.ndarray
    root_quat: np.ndarray
    joint_pos: np.ndarray
    file: Path
    first_row: int = 1
    """Number that a person gives to the first frame in the file: its line in a CSV file."""
    part: str = ""
    """Which motion of the file, where it holds several."""
    notes: tuple[str, ...] = ()
    """What was detected and not stated by the file: units, an order of joints; for the summary."""
    rate_from: str = "file"
    """Who states the frame rate: the file itself, or a setting."""

    @property
    def where(self) -> str:
        """The file, and the motion in it."""
        return f"{self.file}, motion {self.part!r}" if self.part else str(self.file)

    def row(self, frame: int) -> str:
        """A frame as a place in the file."""
        return f"row {frame + self.first_row}"
