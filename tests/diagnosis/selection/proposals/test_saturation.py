"""A limit is tried where its joint's own readings are off, not wherever a window is."""

import mujoco
import numpy as np

from bumblebee.diagnosis.dataset.session import make_session
from bumblebee.diagnosis.residuals.problem import make_problem
from bumblebee.diagnosis.selection.proposals.saturation import _own_off
from bumblebee.diagnosis.simulation.windows import choose_starts, cut
from tests.diagnosis import arm

WINDOWS, OFF = 8, 3


def test_a_window_is_off_for_the_joint_whose_readings_are() -> None:
    """Noise everywhere, and one joint's positions in one window ten standard deviations of noise away."""
    session = make_session(mujoco.MjSpec.from_string(arm.XML), arm.simulate({}, count=2, seconds=3.0), "arm", "memory")
    windows = cut(session.plant, session.layout, session.rollouts, choose_starts(session.rollouts, [0], 0.2, WINDOWS))
    rng = np.random.default_rng(0)
    problem = make_problem(session.plant, session.layout, windows, session.sigma, session.steps, [], rng)
    clean = rng.standard_normal(problem.nuisance.shape[1:])
    raw = np.zeros((windows.measured.shape[1], session.layout.size))
    noise = np.linalg.inv(problem.whitener.factor[OFF])
    spread = np.sqrt(np.diag(noise @ noise.T)).reshape(raw.shape)
    column = np.arange(session.layout.size)[session.layout.slices["joint_pos"]][1]
    raw[:, column] = 10.0 * spread[:, column]
    clean[OFF] += problem.whitener.factor[OFF] @ raw.ravel()
    odd = np.arange(len(clean)) == OFF
    assert _own_off(problem, clean, odd, 1.0).tolist() == [[False, k == OFF, False] for k in range(len(clean))]
    assert not _own_off(problem, clean, np.arange(len(clean)) == OFF + 1, 1.0).any()
    assert not _own_off(problem, clean, odd, 1e4).any()
