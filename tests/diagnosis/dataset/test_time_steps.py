"""Simulation steps that fit the logs' control period."""

import pytest

from bumblebee.diagnosis.dataset.time_steps import longest_step, step_for
from bumblebee.diagnosis.thresholds.dataset import TimeSteps

RULE = TimeSteps()


@pytest.mark.parametrize(
    ("period", "step"), [(0.02, 0.005), (0.01, 0.005), (0.004, 0.004), (0.002, 0.004), (0.001, 0.005)]
)
def test_sensitivities_are_simulated_in_steps_of_up_to_five_milliseconds_at_any_rate(
    period: float, step: float
) -> None:
    assert longest_step(period, 0.005, RULE) == pytest.approx(step)


@pytest.mark.parametrize("longest", [0.001, 0.005])
def test_uneven_stamps_do_not_shorten_the_step(longest: float) -> None:
    """A median of jittering stamps is a little more or less than ten milliseconds."""
    for period in (0.010002, 0.01, 0.009998):
        assert step_for(period, longest, RULE) == pytest.approx(longest, rel=1e-3)
        assert longest_step(period, longest, RULE) == pytest.approx(longest, rel=1e-3)


def test_a_whole_number_of_steps_fits_the_period() -> None:
    for period in (0.02, 0.0167, 0.0101, 0.0033):
        assert (period / step_for(period, 0.001, RULE)) % 1 == pytest.approx(0.0, abs=1e-9)
        assert step_for(period, 0.001, RULE) <= 0.001 * 1.02
