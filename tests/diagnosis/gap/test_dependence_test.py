"""Whether a joint's missing torque depends on anything: not where it is noise, and rare impacts do not decide."""

import numpy as np

from bumblebee.diagnosis.gap.dependence_test import clipped, joint_structure
from bumblebee.diagnosis.thresholds.gap import Dependence
from tests.diagnosis.gap.made import data


def test_noise_has_no_structure() -> None:
    alarms = [
        joint_structure(data(None, 2 * seed), data(None, 2 * seed + 1), joint).significant
        for seed in range(12)
        for joint in range(2)
    ]
    assert sum(alarms) <= 1


def test_rare_impacts_are_brought_nearer_and_the_bulk_stays() -> None:
    values = np.random.default_rng(0).standard_normal(1000)
    struck = values.copy()
    struck[:3] = 100.0
    kept = clipped(struck, Dependence())
    assert kept.max() < 10.0
    np.testing.assert_array_equal(kept[3:], values[3:])
