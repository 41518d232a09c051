"""Joint positions after 1 s: on which windows they are asked, and when they are worse."""

from dataclasses import replace

import numpy as np
import pytest

from bumblebee.diagnosis.comparison.holdout import _grown
from bumblebee.diagnosis.config import DiagnosisConfig
from bumblebee.diagnosis.prepare import gather
from bumblebee.diagnosis.thresholds.comparison import Later
from tests.diagnosis import arm

RNG = np.random.default_rng(0)
NOISE = np.repeat(RNG.standard_normal((1, 900, 3)), 2, axis=0)


@pytest.mark.parametrize("wild, worse", [(0, False), (1, False), (9, True)])
def test_a_joint_that_swings_away_in_one_window_of_a_hundred_is_worse(wild: int, worse: bool) -> None:
    """All other windows are a little better, and by the logarithm that counts; one window alone is an accident."""
    error = 20.0 * NOISE
    error[1] *= 0.9
    error[1, :wild, 0] += 300.0 * (1.0 + RNG.random(wild))
    assert _grown(error, Later()) is worse
    assert not _grown(error, Later(growth_of_square=1e9))


def test_a_little_worse_everywhere_is_worse() -> None:
    assert _grown(NOISE * np.array([1.0, 1.2])[:, None, None], Later(growth_of_square=1e9))


def test_windows_of_a_second_are_of_fitted_rollouts_too_and_more_of_them_judge_the_last_fit() -> None:
    session = arm.session_of(arm.simulate({}, count=6, seconds=8.0))
    config = DiagnosisConfig(max_windows=8, max_holdout_windows=4, max_long_windows=3)
    holdout = gather(session, config, np.random.default_rng(0), lambda text: None).holdout
    fitted = {i for i in session.train if i not in session.accept}
    rollouts = set(holdout.long.rollout.tolist())
    assert rollouts & fitted and rollouts & set(session.accept)
    assert not rollouts & set(session.holdout)
    assert len(holdout.long) == 6 and len(holdout.last) > 12
    assert len(holdout.finely().long) == len(holdout.last)
    few = gather(session, replace(config, grow=False), np.random.default_rng(0), lambda text: None).holdout
    assert len(few.last) == len(few.long) == 6
