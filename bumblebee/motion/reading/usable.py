"""A motion of the robot as its file has it, checked, with unit quaternions in the order that holds."""

from dataclasses import replace

import numpy as np

from bumblebee.motion.checks import NORM_TOLERANCE, check_raw
from bumblebee.motion.raw import RawMotion
from bumblebee.motion.reading.quaternion_order import settled


def usable(raw: RawMotion) -> RawMotion:
    """The motion with what its file leaves unsaid settled by the motion; a note says what was changed.

    Raises:
        BadInput: a check that it fails, or an order of the root's quaternion that nothing tells.
    """
    check_raw(raw)
    return settled(normalised(raw))


def normalised(raw: RawMotion) -> RawMotion:
    """The motion with quaternions of length 1, and a note where they were not."""
    norm = np.linalg.norm(raw.root_quat, axis=1)
    short = norm.min() < 1 - NORM_TOLERANCE
    note = (f"root quaternions of length {norm.min():.2f} to {norm.max():.2f} made 1",) if short else ()
    return replace(raw, root_quat=raw.root_quat / norm[:, None], notes=(*raw.notes, *note))
