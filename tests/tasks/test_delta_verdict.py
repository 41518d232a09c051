"""The line on a delta action says what there is, and no number that is none."""

import math

import pytest

from bumblebee.learning.delta import Gain
from tasks.delta import verdict

NAN = math.nan


@pytest.mark.parametrize(
    ("count", "relative", "low", "high", "said"),
    [
        ((6, 3), -0.2, -0.3, -0.1, "-20.0% [-30.0%, -10.0%] on 6 held-out rollouts of 3 motions"),
        ((1, 1), -0.2, NAN, NAN, "-20.0%, no interval, on 1 held-out rollout of 1 motion"),
        ((1, 1), NAN, NAN, NAN, "no held-out rollout reaches 1 s"),
    ],
)
def test_an_interval_that_is_none_is_not_printed(
    count: tuple[int, int], relative: float, low: float, high: float, said: str
):
    one = {"without": 1.0, "with": 1.0, "relative": relative, "low": low, "high": high}
    line = verdict(1, "c0", Gain(*count, {"1.0": one}, False, "too few"))
    assert said in line and "nan" not in line
