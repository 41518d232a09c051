"""Windows to look at: their times are those of the rollout, whatever clock stamped it."""

from dataclasses import replace

import pytest

from bumblebee.diagnosis.report.example_windows import examples
from bumblebee.diagnosis.report.terminal import plot
from bumblebee.sim.effects import single
from tests.diagnosis import arm

EPOCH = 1.76415e9  # [s] since 1970


def test_times_count_from_the_start_of_the_rollout_where_stamps_are_seconds_since_1970() -> None:
    rollouts = arm.simulate({("motor_strength", "j3"): 0.7}, count=2, seconds=6.0)
    late = [replace(r, time=r.time + EPOCH) for r in rollouts]
    effects = [single("motor_strength", "j3", 0.7)]
    one, other = (examples(arm.session_of(some), effects, count=1)[0] for some in (rollouts, late))
    assert 0.0 <= other["start"] < 6.0 and other["start"] == pytest.approx(one["start"], abs=1e-5)
    assert other["target"] == one["target"], "the target of the same tick, though stamps are coarser"
    assert f"from {other['start']:.2f} s" in plot(other)
