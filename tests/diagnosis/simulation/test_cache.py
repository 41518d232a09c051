"""Residuals are simulated once: the same numbers again, others for other windows, and no more kept than is allowed."""

import mujoco
import numpy as np
import pytest

from bumblebee.diagnosis.dataset.session import make_session
from bumblebee.diagnosis.residuals.problem import Problem, make_problem
from bumblebee.diagnosis.simulation import cache as recall
from bumblebee.diagnosis.simulation.cache import Recall
from bumblebee.diagnosis.simulation.windows import choose_starts, cut
from bumblebee.sim.effects import Effect, single
from tests.diagnosis import arm

MODELS = ([], [single("coulomb_friction", arm.JOINTS[0], 0.2)], [single("command_delay", arm.JOINTS[1], 0.01)])


@pytest.fixture(scope="module")
def problem() -> Problem:
    """A few windows of the arm."""
    session = make_session(mujoco.MjSpec.from_string(arm.XML), arm.simulate({}, count=2, seconds=2.0), "arm", "memory")
    windows = cut(session.plant, session.layout, session.rollouts, choose_starts(session.rollouts, [0], 0.2, 6))
    rng = np.random.default_rng(0)
    return make_problem(session.plant, session.layout, windows, session.sigma, session.steps, [], rng)


def test_known_models_are_not_simulated_again_and_come_out_the_same(problem: Problem) -> None:
    asked: list[int] = []

    def simulate(new: list[list[Effect]]) -> np.ndarray:
        asked.append(len(new))
        return np.stack([np.full((2, 3), float(len(e))) + len(asked) for e in new])

    memory, here = Recall(), (object(),)
    first = memory.get(here, MODELS[:2], 0.001, simulate)
    again = memory.get(here, [MODELS[1], MODELS[2], MODELS[0]], 0.001, simulate)
    assert asked == [2, 1]
    assert np.array_equal(again[[2, 0]], first)
    memory.get(here, MODELS[:1], 0.005, simulate)
    memory.get((object(),), MODELS[:1], 0.001, simulate)
    assert asked == [2, 1, 1, 1]


def test_the_oldest_are_forgotten_first(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recall, "_KEPT_BYTES", 2 * 8 * 6)
    memory, here = Recall(), (object(),)

    def simulate(new: list[list[Effect]]) -> np.ndarray:
        return np.zeros((len(new), 2, 3))

    out = memory.get(here, MODELS, 0.001, simulate)
    assert len(out) == 3
    assert len(memory.kept) == 2
    assert (repr(0.001), *map(repr, MODELS[0])) not in memory.kept


def test_residuals_without_a_value_are_kept() -> None:
    assert Recall().get((object(),), MODELS, 0.001, lambda new: np.zeros((len(new), 0, 3))).shape == (3, 0, 3)


def test_residuals_are_those_of_a_problem_that_remembers_nothing(problem: Problem) -> None:
    some = np.array([0, 2, 3])
    together = problem.residual(MODELS)
    alone = [problem.part(np.arange(len(problem.windows))).residual([m])[0] for m in MODELS]
    np.testing.assert_allclose(together, np.stack(alone), rtol=1e-9, atol=1e-9)
    assert np.array_equal(problem.residual(MODELS), together)
    for k, model in enumerate(MODELS):
        np.testing.assert_allclose(problem.on(some, model), together[k][some], rtol=1e-9, atol=1e-9)
