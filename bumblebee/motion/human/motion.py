"""A motion of a person as positions of landmarks, whatever skeleton its file has."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

LANDMARKS = (
    "pelvis",
    "left_hip",
    "left_knee",
    "left_ankle",
    "left_toe",
    "right_hip",
    "right_knee",
    "right_ankle",
    "right_toe",
    "chest",
    "neck",
    "head",
    "left_shoulder",
    "left_elbow",
    "left_wrist",
    "right_shoulder",
    "right_elbow",
    "right_wrist",
)
"""Joint centres that every reader delivers: `pelvis` the middle of the body's root, `toe` the ball of the foot (where
the toes bend), `chest` the spine joint nearest below the shoulders, `neck` its base, `head` the skull's base or middle,
`shoulder`, `elbow`, `wrist`, `hip`, `knee`, `ankle` the joints' centres."""


@dataclass(frozen=True)
class Role:
    """The joint of a file that stands for a landmark, and what says so; both "" where none was found."""

    landmark: str
    joint: str = ""
    evidence: str = ""


@dataclass(frozen=True, eq=False)
class HumanMotion:
    """Motion of a person at the file's own rate, float64, nothing resampled or smoothed.

    `positions` (T, 18, 3) [m, world, z up, floor near 0] of `LANDMARKS`; left is the person's left.
    """

    name: str
    fps: float
    positions: np.ndarray
    file: Path
    """As it is shown: for a member of an archive the archive's path joined with the member's name."""
    first_row: int = 1
    """Number that a person gives to the first frame in the file."""
    part: str = ""
    """Which motion of the file, where it holds several."""
    notes: tuple[str, ...] = ()
    """Facts that were detected and not stated by the file: units, the up axis, first frames that were cut."""

    skeleton: tuple[Role, ...] = ()
    """For each landmark the joint of the file; none for bodies that are known, such as SMPL's."""

    @property
    def where(self) -> str:
        """The file, and the motion in it."""
        return f"{self.file}, motion {self.part!r}" if self.part else str(self.file)

    def row(self, frame: int) -> str:
        """A frame as a place in the file."""
        return f"frame {frame + self.first_row}"

    def landmark(self, name: str) -> np.ndarray:
        """Positions of one landmark, (T, 3) [m]."""
        return self.positions[:, LANDMARKS.index(name)]
