"""What is forgotten of a new effect of the catalogue is said, with the file and what to add."""

import functools
from pathlib import Path

import numpy as np
import pytest

from bumblebee.diagnosis.candidates.candidate import Candidate, is_simulated, shortlisted
from bumblebee.diagnosis.candidates.enumerate import all_candidates
from bumblebee.diagnosis.candidates.traits import TRAITS
from bumblebee.diagnosis.residuals.problem import Problem
from bumblebee.diagnosis.sensitivities.columns import pulse_sizes, screen
from bumblebee.diagnosis.simulation.declared import declared_values
from bumblebee.sim.effects import CATALOGUE
from tests.diagnosis import arm, stander

HOME = Path(__file__).parents[3]
NOT_SEARCHED = {
    "discovered": "its terms are sought in discrepancy/",
    "encoder_quantisation": "read off the logs by selection/proposals/encoder_resolution.py",
}
ENUMERATE = "bumblebee/diagnosis/candidates/enumerate.py"
SIGNATURES = "bumblebee/diagnosis/sensitivities/torque_signatures.py"
VARIATION = "bumblebee/diagnosis/simulation/variation.py, or the hooks and the spec in bumblebee/sim/effects"


@functools.cache
def robots() -> dict[str, tuple[Problem, list[Candidate]]]:
    """The arm and a robot that stands, each with its windows and candidates."""
    found = {}
    arms = arm.session_of(arm.simulate({}, count=2, seconds=3.0))
    standing = arm.session_of(stander.simulate(seconds=3.0)[0], stander.XML)
    for name, session in (("arm", arms), ("stander", standing)):
        problem = arm.problem_of(session, [0, 1], 24)
        found[name] = problem, all_candidates(session.plant, session.rollouts, [])
    return found


def candidates(kind: str) -> list[tuple[Problem, Candidate]]:
    """Six of each robot's candidates of a kind at most, over all places."""
    found = []
    for problem, every in robots().values():
        own = [c for c in every if c.effect == kind]
        found += [(problem, own[k]) for k in np.unique(np.linspace(0, len(own) - 1, min(6, len(own))).astype(int))]
    return found


SEARCHED = [kind for kind in CATALOGUE if kind not in NOT_SEARCHED]


@pytest.mark.parametrize("kind", SEARCHED)
def test_every_effect_is_a_candidate_somewhere(kind: str) -> None:
    assert candidates(kind), f"{ENUMERATE}: yield a candidate of {kind}"


@pytest.mark.parametrize("kind", SEARCHED)
def test_no_candidate_changes_nothing(kind: str) -> None:
    changes = [np.abs(problem.sensitivities([c])).max() for problem, c in candidates(kind)]
    assert max(changes, default=0.0) > 0, f"{VARIATION}: {kind} changes no prediction"


@pytest.mark.parametrize("kind", SEARCHED)
def test_what_is_screened_by_a_torque_has_one(kind: str) -> None:
    """A column from the torque's signature, not of zeros."""
    largest = [np.inf]
    for problem, c in candidates(kind):
        joints = len(problem.plant.joints)
        if not is_simulated(c, joints) and not shortlisted(c, joints):
            columns, _ = screen(problem, [c], [], pulse_sizes(problem, np.ones(joints)))
            largest = [x for x in largest if np.isfinite(x)] + [float(np.abs(columns.values).max())]
    assert max(largest) > 0, f'{SIGNATURES}: the torque of {kind}, or column="simulated" in candidates/traits.py'


@pytest.mark.parametrize("kind", SEARCHED)
def test_every_effect_has_an_experiment_that_separates_it(kind: str) -> None:
    told = f"bumblebee/diagnosis/candidates/traits.py: say how {kind} is told from what looks the same"
    assert TRAITS[kind].experiment, told


@pytest.mark.parametrize("kind", [k for k in SEARCHED if CATALOGUE[k].on == "joint"])
def test_the_declared_value_of_an_effect_on_a_joint_is_known(kind: str) -> None:
    problem, _ = robots()["arm"]
    values = declared_values(problem.plant, kind, problem.plant.joints[0])
    assert len(values) == len(CATALOGUE[kind].parameters)


@pytest.mark.parametrize("kind", CATALOGUE)
def test_every_effect_stands_in_the_guide(kind: str) -> None:
    guide = (HOME / "docs/diagnosis.md").read_text()
    assert f"`{kind}`" in guide, f"docs/diagnosis.md: add a row for {kind} to 'What it looks for'"
