"""Beyond the catalogue from end to end: a spring that no effect names is found, refitted and kept; nothing else is."""

import mujoco
import numpy as np
import pytest

from bumblebee.diagnosis.discover import discover, inverse_normal
from bumblebee.diagnosis.problem import Problem, make_problem
from bumblebee.diagnosis.session import Session, make_session
from bumblebee.diagnosis.windows import choose_starts, cut
from tests.diagnosis import cart


def prepared(cubic: float) -> tuple[Session, Problem, Problem]:
    rollouts = cart.record(count=4, seconds=8.0, cubic=cubic)
    session = make_session(mujoco.MjSpec.from_string(cart.xml()), rollouts, "cart", "memory")
    problems = []
    for ids in ([i for i in session.train if i not in session.accept], session.accept):
        windows = cut(session.plant, session.layout, session.rollouts, choose_starts(session.rollouts, ids, 0.2, 40))
        rng = np.random.default_rng(0)
        problems.append(make_problem(session.plant, session.layout, windows, session.sigma, session.steps, [], rng))
    return session, problems[0], problems[1]


def test_a_cubic_spring_is_found_with_its_form_and_size() -> None:
    session, problem, holdout = prepared(cubic=0.6)
    found = discover(session, problem, holdout, [], np.zeros(len(problem.nuisance)))
    assert [e.where for e in found.effects] == [("pole",)]
    terms = found.entries[0]["parameters"]["terms"]
    assert [t["term"] for t in terms] == ["q^3"]
    assert terms[0]["coefficient"] == pytest.approx(-0.6, rel=0.02)
    assert terms[0]["ci95"][0] < terms[0]["coefficient"] < terms[0]["ci95"][1]
    assert not found.block["significant"]


def test_a_complete_model_leaves_nothing() -> None:
    session, problem, holdout = prepared(cubic=0.0)
    found = discover(session, problem, holdout, [], np.zeros(len(problem.nuisance)))
    assert found.effects == [] and not found.block["significant"]


def test_a_term_that_does_nothing_has_no_size_and_breaks_nothing() -> None:
    """Its column of zeros leaves the other's coefficient alone."""
    rng = np.random.default_rng(0)
    column, nuisance = rng.standard_normal((12, 5)), rng.standard_normal((2, 12, 5))
    basis, inverse = inverse_normal(nuisance, np.stack((column, np.zeros((12, 5)))), np.ones(12))
    move = inverse @ np.einsum("bwm,wm->b", basis, 3.0 * column)
    np.testing.assert_allclose(move[2:], [3.0, 0.0], atol=1e-3)
