"""Memory of a spring with play, followed on all rollouts at once, equals following each alone."""

import mujoco
import numpy as np
import pytest

from bumblebee.diagnosis.dataset.session import Session, make_session
from bumblebee.diagnosis.simulation.joint_path import joint_path
from bumblebee.diagnosis.simulation.starts.actuator_history import bent_before, yielded
from bumblebee.diagnosis.simulation.windows import choose_starts, cut
from tests.diagnosis import arm


@pytest.fixture(scope="module")
def session() -> Session:
    """Rollouts of two lengths."""
    rollouts = arm.simulate({}, count=2, seconds=2.0) + arm.simulate({}, count=1, seconds=3.0, seed=1)
    return make_session(mujoco.MjSpec.from_string(arm.XML), rollouts, "arm", "memory")


@pytest.mark.parametrize("width", [0.003, 0.2])
def test_an_elasto_plastic_spring_is_followed_from_the_first_tick(session: Session, width: float) -> None:
    every = range(len(session.rollouts))
    windows = cut(session.plant, session.layout, session.rollouts, choose_starts(session.rollouts, every, 0.2, 12))
    expected = []
    for i, k in zip(windows.rollout, windows.start, strict=True):
        path = joint_path(session.rollouts[i], 1, session.plant.thresholds.path)[: k + 1]
        at = path[0]
        for q in path:
            at = min(max(at, q - width), q + width)
        expected.append(at)
    assert np.array_equal(yielded(windows, 1, width, session.plant.thresholds.path), expected)


@pytest.mark.parametrize("width", [0.003, 0.2])
def test_dahls_friction_is_followed_from_the_first_tick(session: Session, width: float) -> None:
    every = range(len(session.rollouts))
    windows = cut(session.plant, session.layout, session.rollouts, choose_starts(session.rollouts, every, 0.2, 12))
    expected = []
    for i, k in zip(windows.rollout, windows.start, strict=True):
        path = joint_path(session.rollouts[i], 1, session.plant.thresholds.path)[: k + 1]
        z = 0.0
        for move in np.diff(path):
            z = np.sign(move) + (z - np.sign(move)) * np.exp(-abs(move) / width) if move else z
        expected.append(z)
    found = bent_before(windows, 1, width, session.plant.thresholds.path)
    assert found == pytest.approx(np.array(expected), abs=1e-9)
