"""Linear recursions, from one tick to the next, solved for all ticks of a log at once."""

import numpy as np

_FORGOTTEN = 1e-18  # below the rounding of what is kept


def first_order(keep: np.ndarray, fed: np.ndarray, begun: np.ndarray) -> np.ndarray:
    """The values (..., T + 1) of y[k + 1] = keep[k] y[k] + fed[k] from y[0] = `begun` (..., 1).

    Two steps are one of the same form: spans of twice as many ticks follow from one another, until nothing is left of
    what was before a span. `keep` (..., T) is between 0 and 1, `fed` as large.
    """
    keep, fed, span = keep.copy(), fed.copy(), 1
    while span < keep.shape[-1] and keep[..., span:].max() > _FORGOTTEN:
        fed[..., span:] += keep[..., span:] * fed[..., :-span]
        keep[..., span:] = keep[..., span:] * keep[..., :-span]
        span *= 2
    return np.concatenate((begun, keep * begun + fed), axis=-1)
