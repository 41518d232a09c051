"""A few poses of a clip, flat enough to be drawn as stick figures."""

import numpy as np

from bumblebee.clustering.features import HEAD, POSITIONS, heading, positions
from bumblebee.motion.clip import Clip
from bumblebee.robot.facts import BODY_OF, PELVIS, TORSO
from bumblebee.robot.written import SIDES

COUNT = 4
"""Poses of a clip: at its start, a third, two thirds, its end."""
SEEN_FROM = np.deg2rad(35.0)
"""Angle between the direction that the motion begins in and the picture's plane: arms and legs of both sides show."""
_CHAINS = (
    (PELVIS, TORSO, HEAD),
    *((PELVIS, *(BODY_OF[f"{side}_{part}"] for part in ("hip", "knee", "foot"))) for side in SIDES),
    *((TORSO, *(BODY_OF[f"{side}_{part}"] for part in ("shoulder", "elbow", "hand"))) for side in SIDES),
)
BONES = tuple(tuple(POSITIONS.index(name) for name in chain) for chain in _CHAINS)
"""Lines of the figure: spine, left leg, right leg, left arm, right arm, as rows of a pose."""


def poses(clip: Clip) -> np.ndarray:
    """(COUNT, 15, 2) [m], float32: across the picture, to the right, from the pelvis; and height above the floor.

    All poses are seen from one side, so that a turn of the body shows.
    """
    frames = np.linspace(0, clip.frames - 1, COUNT).round().astype(int)
    points = positions(clip, frames)
    points = points - points[:, :1] * (1.0, 1.0, 0.0)
    angle = float(heading(clip.root_quat[0])) + SEEN_FROM
    across = points @ np.array([np.cos(angle), np.sin(angle), 0.0])
    return np.stack([across, points[..., 2]], -1).astype(np.float32)
