"""A servo's kd and its joint's viscous friction, fitted together, are told as one."""

import numpy as np
import pytest

from bumblebee.diagnosis.candidates import Candidate, all_candidates
from bumblebee.diagnosis.estimation import Fit, gauss_newton
from bumblebee.diagnosis.residuals import Problem
from bumblebee.diagnosis.selection.proposals.all_joints.joint_damping import one_damping
from tests.diagnosis import arm

KD = 4.0  # of the servo on j2


@pytest.fixture(scope="module")
def problem() -> tuple[Problem, list[Candidate]]:
    session = arm.session_of(arm.simulate({("viscous_friction", "j2"): 1.0}, count=2, seconds=4.0))
    return arm.problem_of(session, [0, 1], 20), all_candidates(session.plant, session.rollouts, [])


def _fit(problem: Problem, candidates: list[Candidate], factor: float, friction: float) -> Fit:
    both = [next(c for c in candidates if (c.effect, c.where) == (kind, "j2")) for kind in ("kd", "viscous_friction")]
    return gauss_newton(problem, both, [factor, friction], np.ones(len(problem.windows)), iterations=0)


@pytest.mark.parametrize(
    ("factor", "friction", "kind", "value"),
    [
        (0.5, 3.0, "viscous_friction", 1.0),
        (1.1, 0.6, "viscous_friction", 1.0),
        (0.6, 0.4, "kd", 0.7),
    ],
)
def test_friction_where_there_is_more_else_a_lower_gain(
    problem: tuple[Problem, list[Candidate]], factor: float, friction: float, kind: str, value: float
) -> None:
    chosen, values = one_damping(problem[0], _fit(*problem, factor, friction))
    assert [c.effect for c in chosen] == [kind]
    assert values == pytest.approx([value])


def test_the_gain_counts_with_the_drives_strength(problem: tuple[Problem, list[Candidate]]) -> None:
    """Half the strength is half the damping: half of that again is 1 N m s less than the drive's 2."""
    kinds = ("motor_strength", "kd", "viscous_friction")
    chosen = [next(c for c in problem[1] if (c.effect, c.where) == (kind, "j2")) for kind in kinds]
    fit = gauss_newton(problem[0], chosen, [0.5, 0.5, 1.6], np.ones(len(problem[0].windows)), iterations=0)
    left, values = one_damping(problem[0], fit)
    assert [c.effect for c in left] == ["motor_strength", "viscous_friction"]
    assert values == pytest.approx([0.5, 0.6])


def test_both_stay_where_one_does_not_do_as_well(
    problem: tuple[Problem, list[Candidate]], monkeypatch: pytest.MonkeyPatch
) -> None:
    fit = _fit(*problem, 0.5, 3.0)
    monkeypatch.setattr(Problem, "residual", lambda self, sets, coarse=False: 2 * fit.residual[None])
    chosen, values = one_damping(problem[0], fit)
    assert tuple(chosen) == fit.chosen
    assert values == pytest.approx(fit.values)
