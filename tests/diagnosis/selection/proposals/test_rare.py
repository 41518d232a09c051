"""Effects on a few windows only: lost commands and limits of torque are named although the rest is at noise."""

import itertools

import numpy as np
import pytest

from bumblebee.diagnosis.diagnose import diagnose
from bumblebee.diagnosis.selection.proposals.loss_likelihoods import LossLikelihoods
from tests.diagnosis import arm
from tests.diagnosis.strange_arm import simulate
from tests.diagnosis.test_catalogue import CONFIG


@pytest.mark.slow
def test_lost_commands_are_found_with_a_share_that_covers() -> None:
    rollouts = simulate({("dropped_commands", ""): (0.03,)}, seed=3)
    session = arm.session_of(rollouts)
    (found,) = diagnose(session, CONFIG).document["effects"]
    assert (found["effect"], found["where"]) == ("dropped_commands", [])
    low, high = found["parameters"]["share"]["ci95"]
    assert low < 0.03 < high < 0.1


@pytest.mark.parametrize(
    ("kind", "value", "parameter"),
    [
        pytest.param("torque_limit", 13.0, "limit", marks=pytest.mark.slow),
        ("torque_speed_limit", 6.0, "speed"),
    ],
)
def test_a_limit_that_few_windows_reach_is_found(kind: str, value: float, parameter: str) -> None:
    rollouts = simulate({(kind, "j2"): (value,)}, seed=3)
    session = arm.session_of(rollouts)
    (found,) = diagnose(session, CONFIG).document["effects"]
    assert (found["effect"], found["where"]) == (kind, ["j2"])
    assert found["parameters"][parameter]["value"] == pytest.approx(value, rel=0.03)


def test_the_share_of_largest_likelihood_is_that_of_the_patterns() -> None:
    """Windows whose pattern is known beyond doubt: the share is the mean of the patterns, and its interval holds it."""
    patterns = np.array(list(itertools.product([False, True], repeat=4)))
    true = np.random.default_rng(0).random((200, 4)) < 0.15
    index = np.array([int(np.flatnonzero((patterns == row).all(axis=1))[0]) for row in true])
    logs = np.full((200, 16), -1e3)
    logs[np.arange(200), index] = 0.0
    losses = LossLikelihoods(patterns, logs - logs[:, :1])
    share = losses.best
    assert share == pytest.approx(true.mean(), rel=1e-6)
    assert (losses.likely(share) == true).all()
    low, high = losses.interval(share)
    assert low < share < high
    spread = np.sqrt(share * (1 - share) / true.size)
    assert high - low == pytest.approx(2 * 1.96 * spread, rel=0.3)
