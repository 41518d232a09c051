"""The longest step of the logs that the simulation keeps to, and how it is divided."""

import numpy as np

from bumblebee.diagnosis.thresholds.dataset import TimeSteps


def step_for(windows_period: float, longest: float, rule: TimeSteps) -> float:
    """The longest step of which a whole number fits the control period [s], above `longest` by a trifle at most."""
    return windows_period / max(1, int(np.ceil(windows_period / longest - rule.uneven)))


def longest_step(windows_period: float, longest: float, rule: TimeSteps) -> float:
    """Longest step [s] for sensitivities: several control periods where these are shorter."""
    return max(1, int(longest / windows_period + rule.uneven)) * step_for(windows_period, longest, rule)


def steps_of(period: float, declared: float, freedom: int, rule: TimeSteps) -> tuple[tuple[float, float], float]:
    """Steps [s] for residuals and for sensitivities, and for residuals while effects are sought.

    Args:
        period: control period of the logs [s].
        declared: time step of the declared model [s].
        freedom: its degrees of freedom.
        rule: what they go by.
    """
    fine = step_for(period, min(rule.fine, declared), rule)
    small = freedom <= rule.small_model
    search = fine if small else max(fine, step_for(period, min(rule.search, declared), rule))
    return (fine, longest_step(period, rule.coarse, rule)), search
