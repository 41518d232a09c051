"""The heat that a drive has gathered before a window starts."""

import numpy as np
import pytest

from bumblebee.diagnosis.simulation.starts.actuator_history import heated
from bumblebee.diagnosis.thresholds.simulation import ActuatorHistory

RULE = ActuatorHistory()


def test_a_drive_that_fades_heats_as_its_own_equation_says() -> None:
    """Under a constant torque dh/dt = (1 - rate h)^2, whose solution is t / (1 + rate t)."""
    time = np.linspace(0.0, 5.0, 2001)
    full = np.ones((len(time), 1))
    fading = heated(time, full[1:], np.array([0.4]), np.zeros(1), RULE)
    assert fading[:, 0] == pytest.approx(time / (1 + 0.4 * time), abs=2e-3)
    assert heated(time, full[1:], np.zeros(1), np.zeros(1), RULE)[:, 0] == pytest.approx(time)


def test_a_drive_without_strength_does_not_heat() -> None:
    time = np.linspace(0.0, 4.0, 401)
    full = np.ones((len(time), 1))
    drifting = heated(time, full[1:], np.zeros(1), np.array([0.5]), RULE)  # no strength is left after 2 s
    assert drifting[-1] == pytest.approx(drifting[200])
    assert drifting[200, 0] == pytest.approx(2.0 / 3.0, rel=0.01)
