"""A second look on other windows: the same columns in the end, and less simulated where nothing is seen again."""

import numpy as np
import pytest

from bumblebee.diagnosis.candidates.candidate import Candidate
from bumblebee.diagnosis.candidates.enumerate import all_candidates
from bumblebee.diagnosis.estimation.gauss_newton import gauss_newton
from bumblebee.diagnosis.residuals import problem as problems
from bumblebee.diagnosis.residuals.problem import Problem, make_problem, screening_windows, window_weights
from bumblebee.diagnosis.selection.screening import Stages
from bumblebee.diagnosis.sensitivities.columns import Columns
from bumblebee.diagnosis.simulation.windows import choose_starts, cut
from tests.diagnosis import arm

SCREENED = 8


@pytest.fixture(scope="module")
def made() -> tuple[Problem, list[Candidate]]:
    """The arm with dry friction on one joint, three times as many windows of it as are screened, some candidates."""
    rollouts = arm.simulate({("coulomb_friction", "j2"): 0.25}, count=2, seconds=3.0)
    session = arm.session_of(rollouts)
    starts = choose_starts(session.rollouts, [0, 1], 0.2, 3 * SCREENED)
    windows = cut(session.plant, session.layout, session.rollouts, starts)
    rng = np.random.default_rng(0)
    problem = make_problem(session.plant, session.layout, windows, session.sigma, session.steps, [], rng)
    names = (("coulomb_friction", "j2"), ("armature", "j1"), ("link_com", "l2"), ("torque_lag", "j1"))
    every = all_candidates(session.plant, session.rollouts, [])
    return problem, [next(c for c in every if (c.effect, c.where) == name) for name in names]


def test_columns_from_two_parts_are_those_of_the_whole(made: tuple[Problem, list[Candidate]]) -> None:
    problem, candidates = made
    stages = Stages(problem, screening_windows(problem, SCREENED))
    assert len(stages.both) == 2 * SCREENED
    assert len(set(stages.both.tolist())) == 2 * SCREENED
    for c in candidates:
        whole = problem.sensitivities([c])
        assert np.abs(stages.columns(problem, c, []) - whole).max() < 1e-4 * np.abs(whole).max(), c.effect


def test_few_windows_are_one_part(made: tuple[Problem, list[Candidate]]) -> None:
    problem, candidates = made
    keep = screening_windows(problem, 2 * SCREENED)
    stages = Stages(problem, keep)
    assert np.array_equal(stages.both, keep)
    assert np.allclose(stages.columns(problem, candidates[0], []), problem.sensitivities(candidates[:1]), rtol=1e-4)
    fit = gauss_newton(problem, (), (), np.ones(len(problem.windows)))
    screened = Columns(candidates[:1], problem.sensitivities(candidates[:1])[:, keep])
    assert stages.tests(problem, screened, candidates, fit, np.ones(len(problem.windows)))[0] == []


def test_what_is_there_is_seen_again_and_what_is_not_falls(
    made: tuple[Problem, list[Candidate]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """And a second look costs the windows that it looks at, no others."""
    problem, candidates = made
    keep = screening_windows(problem, SCREENED)
    weights = window_weights(problem.residual([[]])[0])
    fit = gauss_newton(problem, (), (), weights)
    stages = Stages(problem, keep)
    # What is screened of the armature is made up: on these windows it looks like the friction.
    friction, armature = candidates[:2]
    column = problem.sensitivities([friction])[:, keep]
    screened = Columns([friction, armature], np.concatenate((column, column)))
    simulated: list[int] = []
    real = problems.residuals

    def counted(plant: object, layout: object, windows: object, *rest: object) -> np.ndarray:
        simulated.append(len(windows))
        return real(plant, layout, windows, *rest)

    monkeypatch.setattr(problems, "residuals", counted)
    known, tests = stages.tests(problem, screened, [friction, armature], fit, weights)
    assert known == [friction, armature]
    assert tests.z[0] > 8.0
    assert tests.z[1] < 0.8 * tests.z[0]
    assert set(simulated) == {SCREENED}
    simulated.clear()
    stages.columns(problem, friction, [])
    assert set(simulated) == {2 * SCREENED}
    simulated.clear()
    stages.tests(problem, screened, [friction, armature], fit, weights)
    assert simulated == []


def test_other_windows_have_stages_of_their_own(made: tuple[Problem, list[Candidate]]) -> None:
    problem, _ = made
    keep = screening_windows(problem, SCREENED)
    stages = Stages(problem, keep)
    assert stages.on(problem.relinearised([]), keep) is stages
    assert stages.on(problem.part(np.arange(2 * SCREENED + 6)), keep) is not stages
