"""Words for an effect that the drives undo."""

from typing import Any

import numpy as np

from bumblebee.effects.kind import CannotUndo, Given


def spread(values: np.ndarray, unit: str, digits: int = 3) -> str:
    """`0.1 N m`, or `0.1 to 0.3 N m`."""
    low, high = float(np.min(values)), float(np.max(values))
    text = f"{low:.{digits}g}" if np.isclose(low, high) else f"{low:.{digits}g} to {high:.{digits}g}"
    return f"{text} {unit}".strip()


def fed_along(draft: Any) -> str:
    """How friction is undone, by `compensation.draft.Draft`."""
    return f"{100 * draft.limits.friction_share:.0f} % fed forward along the intended velocity"


def inverse_of(effect: Given) -> str:
    """`0.8, so times 1.25`.

    Raises:
        CannotUndo: if there is no inverse.
    """
    if effect.value() <= 0:
        raise CannotUndo("a gain of nothing times anything is nothing")
    return f"{effect.value():.4g}, so times {1 / effect.value():.4g}"


def milliseconds(effect: Given) -> str:
    """`8 ms`."""
    return f"{1000 * effect.value():.3g} ms"
