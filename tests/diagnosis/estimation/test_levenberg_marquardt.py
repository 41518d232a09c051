"""A fit that begins far from the data holds what would leave its bounds, and solves for the others beside it."""

import numpy as np
import pytest

from bumblebee.diagnosis.candidates import absent, all_candidates
from bumblebee.diagnosis.estimation.gauss_newton import gauss_newton
from bumblebee.diagnosis.estimation.levenberg_marquardt import _moved, levenberg_marquardt
from bumblebee.diagnosis.residuals import window_weights
from tests.diagnosis import arm


def test_a_step_beside_a_bound_is_that_of_the_others_alone() -> None:
    """On a robot without friction that damps half as much as declared: the friction would be below none."""
    session = arm.session_of(arm.simulate({}, count=2, seconds=4.0), arm.XML.replace('kv="4"', 'kv="8"'))
    problem = arm.problem_of(session, [0, 1], 20)
    there = {(c.effect, c.where): c for c in all_candidates(session.plant, session.rollouts, [])}
    gain, friction = there["kd", "j2"], there["viscous_friction", "j2"]
    weights = window_weights(problem.residual([[]])[0])
    alone, both = (
        _moved(problem, gauss_newton(problem, chosen, absent(chosen), weights, iterations=0), weights, 1e-3)
        for chosen in ([gain], [gain, friction])
    )
    assert both[1] == friction.nominal[0]
    assert both[0] == pytest.approx(alone[0])


def test_it_ends_at_the_truth() -> None:
    truth = {("coulomb_friction", j): v for j, v in zip(arm.JOINTS, (1.2, 2.0, 0.8), strict=True)}
    session = arm.session_of(arm.simulate(truth, count=2, seconds=4.0))
    problem = arm.problem_of(session, [0, 1], 30)
    chosen = [c for c in all_candidates(session.plant, session.rollouts, []) if c.effect == "coulomb_friction"]
    fit = levenberg_marquardt(problem, chosen, absent(chosen), 20)
    assert fit.values == pytest.approx(np.array(list(truth.values())), rel=0.1)
