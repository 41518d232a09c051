"""The frame rate of a motion in an `.npz` file, under whatever name the field gives it."""

import numpy as np

from bumblebee.errors import BadInput

RATES = ("mocap_framerate", "mocap_frame_rate", "fps", "frame_rate", "framerate")


def rate_in(where: object, arrays: dict[str, np.ndarray]) -> float | None:
    """The rate that a file states [Hz]; None where it states none.

    Args:
        where: the file.
        arrays: what it holds, by name.

    Raises:
        BadInput: something else than one number that a motion can have.
    """
    found = next((name for name in RATES if name in arrays), None)
    if found is None:
        return None
    values = arrays[found]
    is_number = values.size == 1 and values.dtype.kind in "iuf"
    rate = float(values.reshape(())) if is_number else float("nan")
    if not 1 <= rate <= 1000:
        came = f"{rate:g}" if is_number else f"shape {values.shape}, {values.dtype}"[:80]
        raise BadInput(f"{where}: {found}", "one number of frames a second from 1 to 1000", came)
    return rate
