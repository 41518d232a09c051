"""Effects of nearly the same sensitivity: told apart where data are plain, not by what an integrator makes of them."""

from dataclasses import replace

import numpy as np
import pytest

from bumblebee.diagnosis.candidates import Candidate, all_candidates
from bumblebee.diagnosis.comparison import Holdout, linearly_without
from bumblebee.diagnosis.diagnose import diagnose
from bumblebee.diagnosis.estimation import Fit, gauss_newton
from bumblebee.diagnosis.residuals import Problem
from bumblebee.diagnosis.selection.told_apart import told_apart
from bumblebee.diagnosis.selection.trial import Trial
from bumblebee.diagnosis.thresholds.comparison import NotRefuted
from tests.diagnosis import arm

CONFIG = replace(arm.SMALL, beyond=False)


def test_a_delay_is_told_from_a_filter_and_from_lost_commands() -> None:
    """All agree to 0.99 in their sensitivities at 50 Hz."""
    rollouts = arm.simulate({("command_delay", "j2"): 0.008}, count=4, seconds=3.0, seed=4)
    (found,) = diagnose(arm.session_of(rollouts), CONFIG).document["effects"]
    assert (found["effect"], found["where"], found["equivalent"]) == ("command_delay", ["j2"], [])


@pytest.fixture(scope="module")
def late() -> tuple[Problem, list[Candidate], Fit]:
    """Windows of an arm with a late command, its candidates, and the fit of the delay."""
    session = arm.session_of(arm.simulate({("command_delay", "j2"): 0.008}, count=4, seconds=3.0, seed=4))
    problem = arm.problem_of(session, range(4), 30)
    candidates = [c for c in all_candidates(session.plant, session.rollouts, []) if c.where == "j2"]
    delay = next(c for c in candidates if c.effect == "command_delay")
    return problem, candidates, gauss_newton(problem, (delay,), delay.start, np.ones(30))


def refuted(problem: Problem, candidates: list[Candidate], fit: Fit, effect: str) -> bool:
    """Whether `effect` in the place of the fit's is told apart on fitted windows alone."""
    rival = next(c for c in candidates if c.effect == effect)
    trial = Trial(rival, rival.start, np.inf, np.zeros_like(fit.residual))
    return told_apart(problem, Holdout(), fit, linearly_without(fit, fit.chosen[0]), trial, np.ones(30))


def test_a_rival_is_refuted_by_the_windows_and_the_effect_itself_is_not(
    late: tuple[Problem, list[Candidate], Fit],
) -> None:
    problem, candidates, fit = late
    assert refuted(problem, candidates, fit, "command_filter")
    assert refuted(problem, candidates, fit, "viscous_friction")
    assert not refuted(problem, candidates, fit, "command_delay")


@pytest.mark.parametrize(("name", "value"), [("numerics", 0.0), ("chi_square", 1e9), ("windows", NotRefuted(z=8.0))])
def test_none_is_refuted_by_an_integrator_by_little_or_by_few_windows(
    late: tuple[Problem, list[Candidate], Fit], name: str, value: object
) -> None:
    problem, candidates, fit = late
    confounding = problem.thresholds.selection.confounding
    rules = replace(confounding, told_apart=replace(confounding.told_apart, **{name: value}))
    thresholds = replace(problem.thresholds, selection=replace(problem.thresholds.selection, confounding=rules))
    assert not refuted(replace(problem, thresholds=thresholds), candidates, fit, "command_filter")


def test_servos_that_all_damp_too_little_are_found_and_are_no_friction_below_none() -> None:
    """No single one brings the arm nearer; at one gain viscous friction is a servo's damping, but for its sign."""
    rollouts = arm.simulate({}, count=4, seconds=3.0, seed=4, gains=(1.0, 0.5))
    unaware = arm.session_of([replace(r, meta={}) for r in rollouts])
    found = diagnose(unaware, replace(CONFIG, max_windows=60)).document["effects"]
    assert {(e["effect"], *e["where"]) for e in found} == {("kd", joint) for joint in arm.JOINTS}
    assert not {o["effect"] for e in found for o in e["equivalent"]} & {"viscous_friction", "command_delay"}
    for effect in found:
        low, high = effect["parameters"]["factor"]["ci95"]
        assert low < 0.5 < high and high - low < 0.05
