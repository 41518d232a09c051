"""When a person's heels and balls of the feet stand on the floor, and where that floor is."""

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from bumblebee.motion.grounding import GroundingConfig, floor_height
from bumblebee.motion.human.motion import LANDMARKS
from bumblebee.motion.retarget.config import ContactConfig

PARTS = ("ankle", "toe")
_LOWEST = 2.0  # percentile: robust against a frame in which a marker slips


@dataclass(frozen=True, eq=False)
class Stance:
    """The floor under a person and who stands on it.

    `floor` (T,) [m]: its height; `rest` (2, 2) [m]: how high ankle and toe of each foot are over it while they stand;
    `contact` (T, 2, 2) from 0 to 1: of the left and the right foot, heel and ball.
    """

    floor: np.ndarray
    rest: np.ndarray
    contact: np.ndarray


def foot_points(positions: np.ndarray) -> np.ndarray:
    """Ankles and toes, (T, 2, 2, 3) [m]: side, then ankle and toe."""
    rows = [[LANDMARKS.index(f"{side}_{part}") for part in PARTS] for side in ("left", "right")]
    return positions[:, np.array(rows)]


def stance(positions: np.ndarray, fps: float, config: ContactConfig, grounding: GroundingConfig) -> Stance:
    """The floor and the contacts of a motion, from landmarks (T, 18, 3) [m] at `fps`.

    A part of a foot stands where it is low over the floor and slow. Where neither foot does although the lowest part is
    down, as when a foot slides, the lowest part stands.
    """
    feet = foot_points(positions)
    rest = np.percentile(feet[..., 2], _LOWEST, axis=0)
    rest = np.broadcast_to(rest.mean(axis=0), rest.shape)  # both feet are alike
    above = feet[..., 2] - rest
    floor = floor_height(above.min(axis=(1, 2)), fps, grounding)
    above = above - floor[:, None, None]
    speed = np.linalg.norm(np.gradient(feet, 1 / fps, axis=0), axis=-1)
    down = (above < config.height) & (speed < config.speed)
    idle = ~down.any(axis=(1, 2))
    lowest = above.reshape(len(above), -1).argmin(axis=1)
    held = idle & (above.min(axis=(1, 2)) < config.height)
    down.reshape(len(down), -1)[held, lowest[held]] = True
    width = max(1, round(config.shortest * fps))
    line = np.ones((width, 1, 1), bool)
    down = ndimage.binary_opening(
        ndimage.binary_closing(np.pad(down, ((width, width), (0, 0), (0, 0)), "edge"), line), line
    )
    down = down[width:-width]
    blended = ndimage.gaussian_filter1d(down.astype(float), config.blend * fps, axis=0, mode="nearest")
    # A foot that has left the floor is not held by the frames before it: a jump would lose its height.
    steady = ndimage.grey_opening(above, (width, 1, 1), mode="nearest")
    return Stance(floor, rest, blended * np.clip(2 - steady / config.height, 0, 1))
