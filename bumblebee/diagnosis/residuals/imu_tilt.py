"""A tilt of the base's sensor, by the slopes that the windows were whitened with.

Windows of a robot whose sensor is mounted at an angle start at that angle to their feet, and read it all the way. The
first part is nothing but a start that is off, of which the whitening has the answer as the mean over starts on both
sides. A simulation from one tilted start has another, with the jumps of the feet that just touch, and what is
peculiar to it looks like much information, since noise in the starts does not look so: a tilt fitted with it comes out
too small. So residuals are taken as linear in the tilt, around that which the windows were whitened with.
"""

from collections.abc import Sequence

import numpy as np

from bumblebee.diagnosis.candidates import IMU_TILT
from bumblebee.diagnosis.residuals.whitening import Whitener
from bumblebee.diagnosis.simulation import Layout, Plant, Windows, heights_of
from bumblebee.quaternions import conjugate, from_rotation_vector, multiply
from bumblebee.sim.effects import Effect


def tilt_of(effects: Sequence[Effect]) -> Effect | None:
    """The tilt among some effects."""
    return next((e for e in effects if e.effect == IMU_TILT), None)


def angles(tilt: Effect | None) -> np.ndarray:
    """Roll and pitch (2,) [rad]."""
    return np.zeros(2) if tilt is None else np.array(tilt.values(), dtype=float)


def retilted(effects: Sequence[Effect], tilt: Effect | None) -> list[Effect]:
    """The effects with `tilt` in the place of theirs."""
    return [*(e for e in effects if e.effect != IMU_TILT), *([] if tilt is None else [tilt])]


def tilt_columns(whitener: Whitener, layout: Layout, sigma: np.ndarray, ticks: int) -> np.ndarray:
    """(2, W, M) change of the whitened residual for a roll and a pitch of the sensor of 1 rad.

    The true start is turned back by it, in the base's frame, and every compared orientation is read turned by it.
    """
    first = layout.slices["base_rot"].start
    out = np.empty((2, *whitener.curvature.shape))
    for axis in range(2):
        read = np.zeros((ticks, layout.size))
        read[:, first + axis] = 1.0
        out[axis] = -whitener.slopes[:, first + axis] / sigma[first + axis] - whitener.factor @ read.ravel()
    return out


def raised_by_tilt(plant: Plant, windows: Windows, now: np.ndarray, turn: float) -> np.ndarray:
    """How much higher (2, W) [m/rad] the base stands on its feet, for a sensor with more roll and with more pitch.

    Args:
        plant: the declared model.
        windows: W windows, whose bases' heights are taken from stance.
        now: roll and pitch (2,) [rad] that the sensor has.
        turn: by which it is differentiated to both sides [rad], so that a foot's both ends are felt.
    """
    at, out = slice(plant.base_qpos + 3, plant.base_qpos + 7), []
    for more in turn * np.eye(2):
        high, low = (heights_of(plant, _turned_back(windows.qpos, at, now + side)) for side in (more, -more))
        out.append((high - low) / (2.0 * turn))
    return np.stack(out)


def _turned_back(qpos: np.ndarray, at: slice, tilt: np.ndarray) -> np.ndarray:
    """States (W, nq) whose base stands as it is by a sensor with a roll and pitch (2,) [rad]."""
    qpos = qpos.copy()
    qpos[:, at] = multiply(qpos[:, at], conjugate(from_rotation_vector(np.append(tilt, 0.0))))
    return qpos
