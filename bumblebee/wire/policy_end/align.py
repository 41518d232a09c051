"""A robot's readings in the world of a clip: turned about the vertical and shifted in the plane, as the clip begins."""

from dataclasses import dataclass

import numpy as np

from bumblebee import quaternions


@dataclass(frozen=True)
class Alignment:
    """From the robot's own world, where it booted, to the clip's."""

    turn: np.ndarray
    """(4,) about the vertical."""
    shift: np.ndarray
    """(3,) [m] after the turn; nothing in height."""

    def seen(self, pos: np.ndarray, quat: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Place (3,) and orientation (4,) in the clip's world."""
        return quaternions.rotate(self.turn, pos) + self.shift, quaternions.multiply(self.turn, quat)

    def back(self, quat: np.ndarray) -> np.ndarray:
        """An orientation (4,) of the clip's world in the robot's own."""
        return quaternions.multiply(quaternions.conjugate(self.turn), quat)


def aligned(pos: np.ndarray, quat: np.ndarray, clip_pos: np.ndarray, clip_quat: np.ndarray) -> Alignment:
    """Alignment that puts a robot at pos (3,) [m], quat (4,) over the clip's first frame, heading as that one does."""
    turn = quaternions.multiply(quaternions.heading(clip_quat), quaternions.conjugate(quaternions.heading(quat)))
    shift = clip_pos - quaternions.rotate(turn, pos)
    return Alignment(turn, shift * np.array([1.0, 1.0, 0.0]))
