"""The longest step of the logs that the simulation keeps to, and how it is divided."""

import numpy as np

_UNEVEN = 0.02  # of a step: a median of uneven stamps is no whole number of milliseconds


def step_for(windows_period: float, longest: float) -> float:
    """The longest step of which a whole number fits the control period [s], above `longest` by a trifle at most."""
    return windows_period / max(1, int(np.ceil(windows_period / longest - _UNEVEN)))


def longest_step(windows_period: float, longest: float) -> float:
    """The same for sensitivities, of several control periods where these are shorter [s]."""
    return max(1, int(longest / windows_period + _UNEVEN)) * step_for(windows_period, longest)
