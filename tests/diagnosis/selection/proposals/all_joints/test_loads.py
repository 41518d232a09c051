"""Masses that differ are told beside the usual effects of all joints of a free base, before these share them out."""

from collections.abc import Sequence

import numpy as np
import pytest

from bumblebee.diagnosis.candidates import Candidate, absent
from bumblebee.diagnosis.candidates.enumerate import all_candidates
from bumblebee.diagnosis.estimation.fit import Fit
from bumblebee.diagnosis.estimation.levenberg_marquardt import levenberg_marquardt
from bumblebee.diagnosis.residuals.problem import Problem
from bumblebee.diagnosis.selection.proposals.all_joints.fit import sure_on_the_ground
from bumblebee.diagnosis.selection.proposals.all_joints.loads import with_loads
from tests.diagnosis import arm

FRICTION = {("coulomb_friction", j): v for j, v in zip(arm.JOINTS, (1.2, 2.0, 0.8), strict=True)}


def _problem(masses: dict[str, float]) -> tuple[Problem, list[Candidate]]:
    truth = {**FRICTION, **{("link_mass", body): mass for body, mass in masses.items()}}
    session = arm.session_of(arm.simulate(truth, count=3, seconds=5.0))
    return arm.problem_of(session, [0, 1], 40), all_candidates(session.plant, session.rollouts, [])


def _begun(candidates: Sequence[Candidate]) -> tuple[list[Candidate], np.ndarray]:
    """Friction, damping and rotors of all joints, and their offsets, which share a load out among themselves."""
    kinds = ("coulomb_friction", "viscous_friction", "armature", "encoder_offset")
    chosen = [c for c in candidates if c.effect in kinds and c.where]
    return chosen, np.array(absent(chosen))


def _joints(problem: Problem, candidates: Sequence[Candidate]) -> Fit:
    return levenberg_marquardt(problem, *_begun(candidates), 9)


@pytest.mark.parametrize("masses", [{"l3": 0.9}, {"l2": 1.2}, {"l2": 2.6, "l3": 0.9}])
def test_links_of_another_mass_are_fitted_beside_all_joints(masses: dict[str, float]) -> None:
    problem, candidates = _problem(masses)
    joints = _joints(problem, candidates)
    fit = with_loads(problem, joints, candidates)
    found = {c.where: float(fit.of(c)[0]) for c in fit.chosen if c.effect == "link_mass"}
    assert found.keys() == masses.keys() and fit.power(problem) < joints.power(problem)
    for body, mass in masses.items():
        assert found[body] == pytest.approx(mass, rel=0.05), body


def test_no_mass_comes_beside_the_joints_of_a_robot_whose_masses_are_right() -> None:
    problem, candidates = _problem({})
    joints = _joints(problem, candidates)
    assert with_loads(problem, joints, candidates) is joints
    assert with_loads(problem, joints, _begun(candidates)[0]) is joints


def test_a_load_stays_among_what_is_sure() -> None:
    problem, candidates = _problem({"l3": 0.9})
    fit = sure_on_the_ground(problem, [_begun(candidates)], candidates, lambda text: None)
    assert fit is not None
    found = {(c.effect, c.where): float(fit.of(c)[0]) for c in fit.chosen}
    assert found["link_mass", "l3"] == pytest.approx(0.9, rel=0.05)
    assert {place for place in found if place[0] == "motor_strength"} == set()
    for place, friction in FRICTION.items():
        assert found[place] == pytest.approx(friction, rel=0.1), place
