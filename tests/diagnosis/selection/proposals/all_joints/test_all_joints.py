"""Parameters that are wrong on all joints at once are found together and by name."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bumblebee.diagnosis.candidates.enumerate import all_candidates
from bumblebee.diagnosis.comparison.backward_elimination import certainty
from bumblebee.diagnosis.comparison.compare import compare
from bumblebee.diagnosis.comparison.holdout import Holdout
from bumblebee.diagnosis.comparison.submodel import moved_without
from bumblebee.diagnosis.config import SearchConfig
from bumblebee.diagnosis.dataset.session import Session
from bumblebee.diagnosis.estimation.fit import Fit
from bumblebee.diagnosis.estimation.gauss_newton import gauss_newton
from bumblebee.diagnosis.residuals.problem import Problem, make_problem, window_weights
from bumblebee.diagnosis.selection.changes import Anew, Asked, Asking, Change
from bumblebee.diagnosis.selection.proposals.all_joints import start
from bumblebee.diagnosis.selection.proposals.all_joints.fit import sure_on_the_ground
from bumblebee.diagnosis.selection.proposals.all_joints.standard_parameters import standard_parameters
from bumblebee.diagnosis.simulation.windows import choose_starts, cut
from bumblebee.diagnosis.thresholds import Thresholds
from tests.diagnosis import arm
from tests.diagnosis.selection.begun import answered

TRUTH = {
    **{("coulomb_friction", j): v for j, v in zip(arm.JOINTS, (1.2, 2.0, 0.8), strict=True)},
    **{("viscous_friction", j): v for j, v in zip(arm.JOINTS, (0.8, 1.0, 0.5), strict=True)},
    **{("armature", j): v for j, v in zip(arm.JOINTS, (0.05, 0.06, 0.03), strict=True)},
}


def _opened(effects: dict[tuple[str, str], float]) -> tuple[Session, Problem, Problem]:
    rollouts = arm.simulate(effects, count=3, seconds=5.0)
    session = arm.session_of(rollouts)

    def of(ids: list[int], budget: int) -> Problem:
        windows = cut(session.plant, session.layout, rollouts, choose_starts(rollouts, ids, 0.2, budget))
        rng = np.random.default_rng(0)
        return make_problem(session.plant, session.layout, windows, session.sigma, session.steps, [], rng)

    return session, of([0, 1], 40), of([2], 20)


def _fit_of(session: Session, problem: Problem) -> Fit | None:
    """As of a robot whose base is free."""
    candidates = all_candidates(session.plant, session.rollouts, [])
    begun = standard_parameters(problem, candidates, SearchConfig().level)
    return sure_on_the_ground(problem, begun, candidates, lambda text: None)


def pays(problem: Problem, holdout: Holdout, before: Fit, after: Fit) -> bool:
    return compare(problem, holdout, before, after).passes(problem.thresholds.comparison.together)


def test_friction_damping_and_inertia_of_all_joints_are_found_together() -> None:
    session, problem, other = _opened(TRUTH)
    declared = gauss_newton(problem, (), (), np.ones(len(problem.windows)))
    fit = _fit_of(session, problem)
    assert fit is not None
    found = {(c.effect, c.where): float(fit.of(c)[0]) for c in fit.chosen}
    for place, value in TRUTH.items():
        assert found[place] == pytest.approx(value, rel=0.25), place
    assert set(found) - set(TRUTH) <= {(kind, j) for kind in ("motor_strength", "encoder_offset") for j in arm.JOINTS}
    assert certainty(problem, fit, window_weights(fit.clean(problem))).min() >= 4.0
    assert pays(problem, Holdout(other), declared, fit)
    assert not pays(problem, Holdout(other), fit, declared)
    assert pays(problem, Holdout(), declared, fit) and not pays(problem, Holdout(), fit, declared)


def test_offsets_of_all_encoders_are_found_beside_them() -> None:
    """No torque stands for an offset: the regression says nothing of it, and the rest cannot make up for all."""
    offsets = {("encoder_offset", j): v for j, v in zip(arm.JOINTS, (0.05, -0.06, 0.08), strict=True)}
    session, problem, _ = _opened({**TRUTH, **offsets})
    fit = _fit_of(session, problem)
    assert fit is not None
    found = {(c.effect, c.where): float(fit.of(c)[0]) for c in fit.chosen}
    for joint in arm.JOINTS[1:]:  # the first turns about the vertical: nothing tells where it is
        assert found["encoder_offset", joint] == pytest.approx(offsets["encoder_offset", joint], abs=0.01), joint


def test_without_candidates_nothing_begins() -> None:
    _, problem, _ = _opened({})
    assert standard_parameters(problem, [], SearchConfig().level) == []


def test_what_is_found_on_a_robot_like_its_model_does_not_pay() -> None:
    """Another integrator looks like a little inertia on every joint."""
    session, problem, other = _opened({})
    declared = gauss_newton(problem, (), (), np.ones(len(problem.windows)))
    fit = _fit_of(session, problem)
    assert fit is None or not pays(problem, Holdout(other), declared, fit)


def test_an_effect_taken_out_by_slopes_leaves_what_a_refit_in_the_simulator_leaves() -> None:
    session, problem, _ = _opened({("viscous_friction", "j1"): 0.1, ("viscous_friction", "j2"): 0.1})
    three = [c for c in all_candidates(session.plant, session.rollouts, []) if c.effect == "viscous_friction"]
    weights = window_weights(problem.residual([[]])[0])
    full = gauss_newton(problem, three, [c.nominal[0] for c in three], weights, iterations=3)
    less = moved_without(problem, full, weights, three[2:])
    again = gauss_newton(problem, less.chosen, less.values, weights, iterations=3)
    assert less.chosen == tuple(three[:2])
    assert less.values == pytest.approx(again.values, abs=0.002)
    assert less.cost == pytest.approx(again.cost, rel=0.01)
    declared = gauss_newton(problem, (), (), weights)
    assert moved_without(problem, full, weights, three).cost == pytest.approx(declared.cost, rel=0.05)


def _answer(monkeypatch: pytest.MonkeyPatch, fit: Callable[[], object]) -> None:
    """All joints' fit is `fit()`, of a free base and of a fixed one."""

    def answered(run: object, below: float = np.inf) -> Asking[object]:
        yield from ()
        return fit()

    monkeypatch.setattr(start, "all_joints_of", answered)
    monkeypatch.setattr(start, "sure_among", lambda problem, fit: fit)


def _run_with_one_effect(power: float, whitened_at: float) -> Any:
    """A search that has found one effect and is `power` off; its windows were whitened where that was `whitened_at`."""
    thresholds = Thresholds()
    return SimpleNamespace(
        tried_many=False,
        asked_far=False,
        given=0,
        fall=0.9,
        fit=SimpleNamespace(chosen=("one",)),
        rule=thresholds.selection.forward,
        config=SearchConfig(),
        problem=SimpleNamespace(thresholds=thresholds, plant=SimpleNamespace(floating=True)),
        holdout=None,
        candidates=[],
        say=lambda text: None,
        power=lambda: power,
        whitened_at=whitened_at,
    )


def _took(run: SimpleNamespace, step: Asking[bool], left: float = 0.0) -> tuple[bool, list[Change]]:
    """Play a step on a run that whitening anew leaves at `left`."""

    def make(change: Change) -> None:
        if isinstance(change, Asked):
            run.asked_far, run.tried_many = run.asked_far or change.far, run.tried_many or not change.far
        elif isinstance(change, Anew) and not change.begun:
            run.power = lambda: left

    return answered(step, make)


@pytest.mark.parametrize(("power", "begins"), [(100.0, False), (400.0, True)])
def test_one_effect_is_enough_to_begin_where_residuals_are_hundreds_of_times_the_noise(
    monkeypatch: pytest.MonkeyPatch, power: float, begins: bool
) -> None:
    tried: list[float] = []
    _answer(monkeypatch, lambda: tried.append(power))
    run = _run_with_one_effect(power, power)
    assert not _took(run, start.start_with_all_joints(run))[0]  # nothing came of it
    assert bool(tried) is begins


@pytest.mark.parametrize(("left", "begins"), [(0.9, False), (350.0, True)])
def test_windows_that_were_whitened_far_from_here_are_whitened_anew_first(
    monkeypatch: pytest.MonkeyPatch, left: float, begins: bool
) -> None:
    tried: list[float] = []
    _answer(monkeypatch, lambda: tried.append(left))
    monkeypatch.setattr(start, "whitened_anew", lambda *_: (None, None, None))
    run = _run_with_one_effect(400.0, 5000.0)
    assert _took(run, start.start_with_all_joints(run), left)[0] is not begins  # of many effects nothing came
    assert bool(tried) is begins
    assert run.tried_many is begins


FAR = {"power": 400.0, "left": 5.0, "cost": 10.0, "least": 100.0, "before": 110.0}
"""Windows of an arm that is far off: less than 5 % of 400 left, at a tenth of what the best effect by itself leaves."""


@pytest.mark.parametrize(
    ("changed", "begins"),
    [
        ({}, True),
        ({"power": 20.0, "left": 0.9}, False),  # near enough for one effect after the other
        ({"left": 21.0}, False),
        ({"cost": 40.0}, False),
        ({"asked_far": True}, False),
        ({"chosen": ("one",)}, False),
        ({"floating": True}, True),
        ({"left": 21.0, "floating": True}, False),
        ({"before": 200.0, "floating": True}, False),  # one joint's effect leaves half
        ({"before": 200.0, "floating": True, "where": ""}, True),
        ({"before": 400.0, "floating": True, "where": ""}, False),  # the whole robot's leaves a quarter
        ({"before": 400.0}, True),
        ({"pays": False}, False),
    ],
)
def test_a_robot_far_from_the_data_begins_with_all_joints_where_they_leave_next_to_nothing(
    monkeypatch: pytest.MonkeyPatch, changed: dict[str, Any], begins: bool
) -> None:
    case = {**FAR, "asked_far": False, "chosen": (), "floating": False, "pays": True, "where": "j1", **changed}
    run = _run_with_one_effect(case["power"], case["power"])
    run.fit = SimpleNamespace(chosen=case["chosen"], cost=case["before"])
    run.weights, run.asked_far = None, case["asked_far"]
    run.problem.plant = SimpleNamespace(floating=case["floating"])
    tried = [SimpleNamespace(cost=case["least"], candidate=SimpleNamespace(where=case["where"]))]
    fit = SimpleNamespace(power=lambda problem: case["left"], residual=None)
    _answer(monkeypatch, lambda: fit)
    monkeypatch.setattr(start, "cost_of", lambda *_: (case["cost"], None))
    monkeypatch.setattr(start, "compare", lambda *_: SimpleNamespace(passes=lambda rule: case["pays"]))
    monkeypatch.setattr(start, "whitened_anew", lambda problem, holdout, fit: (problem, holdout, fit))
    began, asked = _took(run, start.start_far_off(run, tried))
    assert began is begins
    assert [change.fit for change in asked if isinstance(change, Anew)] == [fit] * begins
    assert not _took(run, start.start_far_off(run, tried))[0]  # it is asked once, and only then


@pytest.mark.parametrize(("floating", "asked"), [(False, True), (True, False)])
def test_a_fixed_base_that_nothing_brings_nearer_is_asked_for_all_joints_sooner(
    monkeypatch: pytest.MonkeyPatch, floating: bool, asked: bool
) -> None:
    tried: list[float] = []
    _answer(monkeypatch, lambda: tried.append(10.0))
    run = _run_with_one_effect(10.0, 10.0)
    run.problem.plant = SimpleNamespace(floating=floating)
    assert not _took(run, start.start_with_all_joints(run, stuck=True))[0]
    assert bool(tried) is asked


def test_what_left_too_much_to_begin_with_is_asked_again_where_nothing_helps(monkeypatch: pytest.MonkeyPatch) -> None:
    """The beginning asks for next to nothing; where no effect helps it is enough that all joints pay."""
    _answer(monkeypatch, lambda: "a fit")
    monkeypatch.setattr(start, "compare", lambda *_: SimpleNamespace(passes=lambda rule: True))
    monkeypatch.setattr(start, "whitened_anew", lambda problem, holdout, fit: (problem, holdout, fit))
    run = _run_with_one_effect(100.0, 100.0)
    run.fit, run.asked_far = SimpleNamespace(chosen=()), True
    began, asked = _took(run, start.start_with_all_joints(run, stuck=True))
    assert began and [change.fit for change in asked if isinstance(change, Anew)] == ["a fit"]
