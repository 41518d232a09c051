"""The last fit is whitened anew as long as its model changes what a window shows, and not once more."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from bumblebee.diagnosis.candidates.enumerate import all_candidates
from bumblebee.diagnosis.comparison.holdout import Holdout
from bumblebee.diagnosis.estimation.fit import Fit
from bumblebee.diagnosis.estimation.gauss_newton import gauss_newton
from bumblebee.diagnosis.residuals.problem import Problem, make_problem, window_weights
from bumblebee.diagnosis.selection import final_fit as refining
from bumblebee.diagnosis.selection.final_fit import refine
from bumblebee.diagnosis.simulation.windows import choose_starts, cut
from bumblebee.diagnosis.thresholds import Thresholds
from tests.diagnosis import arm

LIMIT = 4.0


@pytest.fixture(scope="module")
def limited() -> tuple[Problem, list]:
    """The arm with a torque limit on one joint, which decides everything in the windows that reach it."""
    rollouts = arm.simulate({("torque_limit", "j2"): LIMIT}, count=2, seconds=4.0, seed=100)
    session = arm.session_of(rollouts)
    windows = cut(session.plant, session.layout, session.rollouts, choose_starts(session.rollouts, [0, 1], 0.2, 24))
    rng = np.random.default_rng(0)
    problem = make_problem(session.plant, session.layout, windows, session.sigma, session.steps, [], rng)
    every = all_candidates(session.plant, session.rollouts, [])
    return problem, [next(c for c in every if (c.effect, c.where) == ("torque_limit", "j2"))]


@pytest.mark.parametrize(("start", "least", "most"), [(LIMIT, 1, 1), (1.25 * LIMIT, 2, 4)])
def test_whitened_as_often_as_the_model_changes(
    limited: tuple[Problem, list], monkeypatch: pytest.MonkeyPatch, start: float, least: int, most: int
) -> None:
    problem, chosen = limited
    begun = gauss_newton(problem, chosen, [start], window_weights(problem.residual([[]])[0]), iterations=0)
    whitened: list[int] = []

    def counted(*args: object, **settings: object) -> Problem:
        whitened.append(1)
        return make_problem(*args, **settings)

    monkeypatch.setattr(refining, "make_problem", counted)
    last = refine(problem, begun, np.random.default_rng(0))
    assert least <= len(whitened) <= most
    assert last.fit.values[0] == pytest.approx(LIMIT, rel=0.02)


def test_a_limit_whose_interval_holds_the_declared_one_is_not_named(
    limited: tuple[Problem, list], monkeypatch: pytest.MonkeyPatch
) -> None:
    problem, chosen = limited
    begun = gauss_newton(problem, chosen, [LIMIT], window_weights(problem.residual([[]])[0]), iterations=0)
    declared = chosen[0].nominal[0]
    for half, named in ((0.9 * (declared - LIMIT), True), (1.1 * (declared - LIMIT), False)):
        monkeypatch.setattr(refining, "half_widths", lambda *_, half=half: np.array([half]))
        last = refine(problem, begun, np.random.default_rng(0))
        assert [c.effect for c in last.fit.chosen] == (["torque_limit"] if named else [])
        assert len(last.half) == len(last.fit.chosen)


@pytest.mark.parametrize(("alone", "left"), [(0.5, ["coulomb_friction"]), (1.1, ["coulomb_friction", "armature"])])
def test_what_another_integrator_would_have_found_goes_but_not_what_the_windows_leave_open(
    monkeypatch: pytest.MonkeyPatch, alone: float, left: list[str]
) -> None:
    """Among two whose intervals hold the declared values, an integrator's share included, the less sure goes first."""
    session = arm.session_of(arm.simulate({("coulomb_friction", "j2"): 0.6}, count=2, seconds=4.0, seed=100))
    problem = arm.problem_of(session, [0, 1], 24)
    every = all_candidates(session.plant, session.rollouts, [])
    names = (("coulomb_friction", "j2"), ("armature", "j3"))
    chosen = [next(c for c in every if (c.effect, c.where) == name) for name in names]
    begun = gauss_newton(problem, chosen, [0.6, 0.012], window_weights(problem.residual([[]])[0]), iterations=0)

    def half(share: float) -> Callable[[Problem, Fit, np.ndarray], np.ndarray]:
        """Half-widths in shares of what is between the values and the declared ones; the friction alone is sure."""
        both = [share, share + 0.2 * (share > 1)]
        return lambda _, fit, weights: (
            np.abs(fit.values - [c.nominal[0] for c in fit.chosen]) * (both if len(fit.chosen) == 2 else [0.5])
        )

    monkeypatch.setattr(refining, "half_widths", half(1.1))
    monkeypatch.setattr(refining, "interval", half(alone))
    last = refine(replace(problem, thresholds=_sure_of_all(problem)), begun, np.random.default_rng(0))
    assert [c.effect for c in last.fit.chosen] == left
    assert last.fit.values[0] == pytest.approx(0.6, rel=0.1)


@pytest.mark.parametrize(("many", "made_of"), [(30, [3, 2, 2, 2]), (1, [2])])
def test_what_the_others_cannot_make_up_for_stays_however_far_another_integrator_would_move_it(
    monkeypatch: pytest.MonkeyPatch, many: int, made_of: list[int]
) -> None:
    """Two frictions of two joints are no integrator's; an armature that is not there still is.

    Of many effects what goes is followed by a refit by slopes, and the last step comes once, at the end.
    """
    truth = {("coulomb_friction", "j1"): 0.8, ("coulomb_friction", "j2"): 0.6}
    session = arm.session_of(arm.simulate(truth, count=2, seconds=4.0, seed=100))
    problem = arm.problem_of(session, [0, 1], 24)
    every = all_candidates(session.plant, session.rollouts, [])
    chosen = [next(c for c in every if (c.effect, c.where) == name) for name in (*truth, ("armature", "j3"))]
    begun = gauss_newton(problem, chosen, [0.8, 0.6, 0.0061], window_weights(problem.residual([[]])[0]), iterations=0)

    def half(share: float) -> Callable[[Problem, Fit, np.ndarray], np.ndarray]:
        return lambda _, fit, weights: share * np.abs(fit.values - [c.nominal[0] for c in fit.chosen])

    monkeypatch.setattr(refining, "half_widths", half(10.0))
    monkeypatch.setattr(refining, "interval", half(0.5))
    made: list[int] = []
    real = refining.last_step
    monkeypatch.setattr(refining, "last_step", lambda p, c, *rest: made.append(len(c)) or real(p, c, *rest))
    last = refine(replace(problem, thresholds=_sure_of_all(problem, many)), begun, np.random.default_rng(0))
    assert [(c.effect, c.where) for c in last.fit.chosen] == list(truth)
    assert last.fit.values == pytest.approx([0.8, 0.6], rel=0.1)
    assert made == made_of


def test_slopes_of_many_effects_hold_in_a_round_and_lead_to_the_same_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    truth = {("coulomb_friction", "j1"): 0.8, ("coulomb_friction", "j2"): 0.6}
    session = arm.session_of(arm.simulate(truth, count=2, seconds=4.0, seed=100))
    problem = arm.problem_of(session, [0, 1], 24)
    every = all_candidates(session.plant, session.rollouts, [])
    chosen = [next(c for c in every if (c.effect, c.where) == name) for name in truth]
    begun = gauss_newton(problem, chosen, [0.5, 0.4], window_weights(problem.residual([[]])[0]), iterations=0)
    simulated: list[int] = []
    real = Problem.differences

    def counted(self: Problem, effects: list, moved: list, coarse: bool) -> np.ndarray:
        simulated.append(len(moved))
        return real(self, effects, moved, coarse)

    monkeypatch.setattr(Problem, "differences", counted)
    fits, counts = [], []
    for many in (30, 1):
        simulated.clear()
        fits.append(refine(replace(problem, thresholds=_sure_of_all(problem, many)), begun, np.random.default_rng(0)))
        counts.append(sum(simulated))
    one, held = fits
    assert held.fit.chosen == one.fit.chosen == tuple(chosen)
    assert np.all(np.abs(held.fit.values - one.fit.values) < 0.1 * one.half)
    assert counts[1] < 0.8 * counts[0]


@pytest.mark.parametrize("many", [30, 1])
def test_what_short_windows_led_astray_stays_as_it_was_found(monkeypatch: pytest.MonkeyPatch, many: int) -> None:
    truth = {("coulomb_friction", "j1"): 0.8, ("coulomb_friction", "j2"): 0.6}
    session = arm.session_of(arm.simulate(truth, count=2, seconds=4.0, seed=100))
    problem = arm.problem_of(session, [0, 1], 24)
    every = all_candidates(session.plant, session.rollouts, [])
    chosen = [next(c for c in every if (c.effect, c.where) == name) for name in truth]
    found = gauss_newton(problem, chosen, [0.7, 0.5], window_weights(problem.residual([[]])[0]), iterations=0)
    monkeypatch.setattr(Holdout, "worse_later", lambda self, before, after: True)
    thresholds = _sure_of_all(problem, many)
    last = refine(replace(problem, thresholds=thresholds), found, np.random.default_rng(0), Holdout())
    assert last.fit.chosen == tuple(chosen) and last.fit.values == pytest.approx(found.values)


def _sure_of_all(problem: Problem, many: int = 30) -> Thresholds:
    """Thresholds by which no effect is insignificant, whatever it is."""
    selection = problem.thresholds.selection
    final = replace(selection.final_fit, sure=-1.0, many=many)
    return replace(problem.thresholds, selection=replace(selection, final_fit=final))


def test_where_nothing_is_significant_in_the_end_nothing_is_named(
    limited: tuple[Problem, list], monkeypatch: pytest.MonkeyPatch
) -> None:
    problem, chosen = limited
    begun = gauss_newton(problem, chosen, [LIMIT], window_weights(problem.residual([[]])[0]), iterations=0)
    monkeypatch.setattr(refining, "drop_insignificant", lambda problem, fit, *_: fit.without(fit.chosen))
    last = refine(problem, begun, np.random.default_rng(0))
    assert last.fit.chosen == ()
    assert last.fit.cost > begun.cost
    assert last.half.shape == (0,)
