"""Effects that slopes call unsure stay where the simulator says that the others cannot make up for them."""

from dataclasses import replace

import numpy as np
import pytest

from bumblebee.diagnosis.candidates.enumerate import all_candidates
from bumblebee.diagnosis.comparison import backward_elimination, drop_unsure
from bumblebee.diagnosis.estimation.gauss_newton import gauss_newton
from bumblebee.diagnosis.residuals.problem import window_weights
from tests.diagnosis import arm

TRUTH = {("coulomb_friction", "j1"): 0.8, ("armature", "j2"): 0.2}


def test_what_the_others_cannot_make_up_for_stays(monkeypatch: pytest.MonkeyPatch) -> None:
    session = arm.session_of(arm.simulate(TRUTH, count=2, seconds=4.0))
    problem = arm.problem_of(session, [0, 1], 24)
    every = all_candidates(session.plant, session.rollouts, [])
    places = [*TRUTH, ("encoder_offset", "j3")]
    chosen = [next(c for c in every if (c.effect, c.where) == place) for place in places]
    weights = window_weights(problem.residual([[]])[0])
    fit = gauss_newton(problem, chosen, [0.8, 0.2, 0.0], weights, iterations=1)
    monkeypatch.setattr(backward_elimination, "certainty", lambda problem, fit, weights: np.zeros(len(fit.chosen)))
    assert drop_unsure(problem, fit, weights).chosen == ()
    sure = drop_unsure(problem, replace(fit, cost=0.0), weights, simulated=True)  # the cost is asked anew, not believed
    assert sure.chosen == tuple(chosen[:2])
    assert sure.values == pytest.approx([0.8, 0.2], rel=0.1)
    again = gauss_newton(problem, sure.chosen, sure.values, weights, iterations=0)
    assert sure.cost == pytest.approx(again.cost) and sure.residual == pytest.approx(again.residual)
