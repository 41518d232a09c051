"""A motion as its file holds it, before anything is made of it."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np


def is_order(letters: str) -> bool:
    """Whether letters name an order of a quaternion's parts."""
    return sorted(letters) == sorted("wxyz")


def as_wxyz(values: np.ndarray, order: str) -> np.ndarray:
    """Quaternions (..., 4) of an order as wxyz."""
    return values[..., [order.index(part) for part in "wxyz"]]


@dataclass(frozen=True)
class RawMotion:
    """Motion of the robot from a file: arrays at the file's own rate, float64.

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
    """Notes on what was detected and not stated by the file: units, an order of joints; for the summary."""
    rate_from: str = "file"
    """Who states the frame rate: the file itself, or a setting."""
    amass_fps: float | None = None
    """Rate at which AMASS states to have recorded it [Hz]."""

    quat_order: str = "wxyz"
    """Order of the root's quaternion in the file, as it was read."""
    order_from: Literal["", "file", "known"] = "known"
    """Who states that order: the file, or a setting or this program (`known`); "": nobody, it is the format's."""

    @property
    def where(self) -> str:
        """The file, and the motion in it."""
        return f"{self.file}, motion {self.part!r}" if self.part else str(self.file)

    def row(self, frame: int) -> str:
        """A frame as a place in the file."""
        return f"row {frame + self.first_row}"
