"""A new effect of the catalogue that lacks something says so, with the file and what to add."""

import functools
import importlib
from pathlib import Path

import mujoco
import numpy as np
import pytest
from mujoco.batch import Batch

from bumblebee.deploy.undeclared.kinds import KINDS
from bumblebee.diagnosis.candidates.candidate import Candidate, is_simulated, shortlisted
from bumblebee.diagnosis.candidates.enumerate import all_candidates
from bumblebee.diagnosis.candidates.exclusion import is_chosen
from bumblebee.diagnosis.candidates.traits import TRAITS
from bumblebee.diagnosis.residuals.problem import Problem
from bumblebee.diagnosis.sensitivities.columns import pulse_sizes, screen
from bumblebee.diagnosis.simulation.declared import declared_values
from bumblebee.diagnosis.simulation.variation import Variation, vary
from bumblebee.errors import BadInput
from bumblebee.sim.effects import ADDED, CATALOGUE, StepHooks, add_to_spec, runtime_hooks
from bumblebee.sim.effects.forces import _REMEMBERED
from bumblebee.sim.effects.hooks import HOOKS
from tests.diagnosis import arm, stander

HOME = Path(__file__).parents[3]
NOT_SEARCHED = {
    "discovered": "its terms are sought in discrepancy/",
    "encoder_quantisation": "read off the logs by selection/proposals/encoder_resolution.py",
}
NOT_DRAWN = {
    "surface_contact": "how low a robot comes depends on its motion: tests/diagnosis/selection/test_surface_contact.py",
}
ENUMERATE = "bumblebee/diagnosis/candidates/enumerate.py"
SIGNATURES = "bumblebee/diagnosis/sensitivities/torque_signatures.py"
IN_PLACE = "bumblebee/diagnosis/simulation/in_place.py"
BESIDE_THE_MODEL = {"actuator_delay", "actuator_history"}
EQUATIONS = ("test_effect_equations.py", "test_structural_equations.py", "test_effects.py", "test_effect_engine.py")
VARIATION = "bumblebee/diagnosis/simulation/variation.py, or the hooks and the spec in bumblebee/sim/effects"


@functools.cache
def robots() -> dict[str, tuple[Problem, list[Candidate]]]:
    """The arm and a robot that stands, each with its windows and candidates."""
    found = {}
    arms = arm.session_of(arm.simulate({}, count=2, seconds=3.0))
    standing = arm.session_of(stander.simulate(seconds=3.0)[0], stander.XML)
    for name, session in (("arm", arms), ("stander", standing)):
        problem = arm.problem_of(session, [0, 1], 12)
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
    seen = any(np.abs(problem.sensitivities([c])).max() > 0 for problem, c in candidates(kind))
    assert seen, f"{VARIATION}: {kind} changes no prediction"


@pytest.mark.parametrize("kind", SEARCHED)
def test_what_is_screened_by_a_torque_has_one(kind: str) -> None:
    """A column from the torque's signature, not of zeros."""
    by_torque = [(p, c) for p, c in candidates(kind) if not (is_simulated(c, count(p)) or shortlisted(c, count(p)))]
    columns = (screen(p, [c], [], pulse_sizes(p, np.ones(count(p))))[0].values for p, c in by_torque)
    told = f'{SIGNATURES}: the torque of {kind}, or column="simulated" in candidates/traits.py'
    assert not by_torque or any(np.abs(values).max() > 0 for values in columns), told


def count(problem: Problem) -> int:
    return len(problem.plant.joints)


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


@pytest.mark.parametrize("kind", ADDED)
def test_a_model_varied_in_place_is_the_one_that_the_spec_makes(kind: str) -> None:
    """Every array of the compiled model, but what `Variation` has beside it: delays, and what belongs to them."""
    compared = 0
    for problem, c in candidates(kind) if kind in SEARCHED else []:
        effect, spec = c.at(c.start), problem.plant.spec.copy()
        add_to_spec(spec, [effect])
        made, varied = spec.compile(), vary(problem.plant, [effect]).model
        for name in _arrays(made):
            told = f"{IN_PLACE}: {name} after {effect}"
            np.testing.assert_allclose(getattr(varied, name), getattr(made, name), rtol=1e-6, atol=1e-9, err_msg=told)
            compared += 1
    assert compared or kind not in SEARCHED


def _arrays(model: mujoco.MjModel) -> list[str]:
    names = [name for name in dir(model) if isinstance(getattr(model, name), np.ndarray)]
    return [n for n in names if getattr(model, n).dtype.kind == "f" and n not in BESIDE_THE_MODEL]


@pytest.mark.parametrize("kind", SEARCHED)
def test_what_mjcf_cannot_carry_together_is_never_chosen_together(kind: str) -> None:
    """Two effects on a joint make a spec that has both and is the model of neither, or one row names the other."""
    problem, every = robots()["arm"]
    joint = problem.plant.joints[-1]
    mine = [c for c in every if (c.effect, c.where) == (kind, joint)]
    others = {o.effect: o for o in every if o.where == joint and o.effect != kind}
    for c, o in [(c, o) for c in mine[:2] for o in others.values()]:
        if not is_chosen(c, [o]):
            told = f"bumblebee/diagnosis/candidates/traits.py: not_beside=({o.effect!r},) for {kind}"
            both = [c.at(c.start), o.at(o.start)]
            try:
                add_to_spec(problem.plant.spec.copy(), both)
            except BadInput as error:
                raise AssertionError(f"{told}: {error}") from error
            for one in (c, o):
                assert not _same(vary(problem.plant, both), vary(problem.plant, [one.at(one.start)])), told


def _same(one: Variation, other: Variation) -> bool:
    """Whether two variations are one model with the same beside it."""
    if one.model.nq != other.model.nq or one.setpoints != other.setpoints or not np.array_equal(one.delay, other.delay):
        return False
    if one.hooks is not None or other.hooks is not None or one.dropped is not None or other.dropped is not None:
        return False
    return all(np.array_equal(getattr(one.model, name), getattr(other.model, name)) for name in _arrays(one.model))


def test_what_hooks_carry_from_step_to_step_is_saved() -> None:
    """An array of `StepHooks` that a step has changed is remembered, or a field of the model."""
    problem, every = robots()["arm"]
    changed: set[str] = set()
    for c in {c.effect: c for c in every if c.effect in HOOKS}.values():
        model = vary(problem.plant, [c.at(c.start)]).model
        batch = Batch(model, 1, 1)
        hooks = StepHooks(runtime_hooks([c.at(c.start)], model), model, batch)
        hooks.reset(np.array([0]))
        before = {name: value.copy() for name, value in vars(hooks).items() if isinstance(value, np.ndarray)}
        for _ in range(5):
            batch.ctrl[:] = 0.3
            hooks.apply()
            batch.step()
        changed |= {name for name, value in before.items() if not np.array_equal(value, getattr(hooks, name))}
    forgotten = changed - {f"_{name}" for name in _REMEMBERED}
    assert not forgotten, f"bumblebee/sim/effects/forces.py: add {sorted(forgotten)} to _REMEMBERED"
    assert {"_time", "_heat", "_lagged", "_past_q"} <= changed


@pytest.mark.parametrize("kind", SEARCHED)
def test_every_effect_has_an_equation_from_another_hand(kind: str) -> None:
    written = "".join((HOME / "tests/sim" / name).read_text() for name in EQUATIONS)
    assert f'"{kind}"' in written, f"tests/sim/{EQUATIONS[0]}: the equation of {kind}, integrated in NumPy"
    told = f"bumblebee/deploy/undeclared/kinds.py: a law of {kind} for the sealed benchmark, sharing no code"
    assert kind in KINDS or kind in NOT_DRAWN, told


@pytest.mark.parametrize("module", ["compensation_rules", "stand_in_effects", "undeclared.faults"])
def test_what_a_module_of_the_deployment_wants_of_each_effect_it_has(module: str) -> None:
    """Each compares its table with the catalogue's, or with the sealed benchmark's, as it is imported."""
    assert importlib.import_module(f"bumblebee.deploy.{module}")
