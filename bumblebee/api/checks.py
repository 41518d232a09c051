"""Checks of the API's arguments: one line that names the argument and both shapes."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.motion.clip import Clip


def array(name: str, value: Any, *shape: int | str) -> np.ndarray:
    """A finite float array of the given shape.

    Args:
        name: the argument, for the message.
        value: what the caller passed.
        shape: a number, or a letter for a length that equal letters of one call do not share.

    Raises:
        BadInput: numbers that are none, another shape, NaN or infinity.
    """
    expected = f"an array ({', '.join(map(str, shape))}{',' * (len(shape) == 1)}) of numbers"
    try:
        made = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise BadInput(name, expected, type(value).__name__) from None
    fits = len(made.shape) == len(shape) and all(
        isinstance(want, str) or want == size for want, size in zip(shape, made.shape, strict=True)
    )
    if not fits:
        raise BadInput(name, expected, f"shape {made.shape}")
    if not np.isfinite(made).all():
        raise BadInput(name, "finite numbers", f"{int((~np.isfinite(made)).sum())} that are NaN or infinite")
    return made


def motions(value: Any, name: str = "motions") -> list[Clip]:
    """At least one clip, from one clip or a sequence of them.

    Raises:
        BadInput: anything else.
    """
    some = [value] if isinstance(value, Clip) else value
    if isinstance(some, str) or not isinstance(some, Sequence):
        some = [some]
    wrong = next((one for one in some if not isinstance(one, Clip)), None)
    if wrong is not None or not some:
        came = "an empty list" if wrong is None else type(wrong).__name__
        raise BadInput(name, "a Clip or a list of them", came, "Read them with bumblebee.read_motions(path).")
    return list(some)
