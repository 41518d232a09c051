"""A new effect of the catalogue that lacks something says so, with the file and what to add."""

import functools
import inspect
from pathlib import Path

import mujoco
import numpy as np
import pytest
from mujoco.batch import Batch

from bumblebee.diagnosis.candidates.candidate import Candidate, is_simulated, shortlisted
from bumblebee.diagnosis.candidates.enumerate import all_candidates
from bumblebee.diagnosis.candidates.exclusion import is_chosen
from bumblebee.diagnosis.residuals.problem import Problem
from bumblebee.diagnosis.sensitivities.columns import pulse_sizes, screen
from bumblebee.diagnosis.simulation.declared import declared_values
from bumblebee.diagnosis.simulation.variation import Variation, vary
from bumblebee.effects.guide import page
from bumblebee.errors import BadInput
from bumblebee.sim.effects import CATALOGUE, StepHooks, add_to_spec, runtime_hooks
from bumblebee.sim.effects.memory import REMEMBERED
from bumblebee.stand_in.undeclared.kinds import KINDS
from tests.diagnosis import arm, stander

HOME = Path(__file__).parents[3]
NOT_SEARCHED = {
    "discovered": "its terms are sought in discrepancy/",
    "encoder_quantisation": "read off the logs by selection/proposals/encoder_resolution.py",
}
NOT_DRAWN = {
    "surface_contact": "how low a robot comes depends on its motion: test_surface_contact.py",
}
BESIDE_THE_MODEL = {"actuator_delay", "actuator_history"}


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
    assert candidates(kind), f"{_file(kind)}: steps: yield a candidate"


@pytest.mark.parametrize("kind", SEARCHED)
def test_no_candidate_changes_nothing(kind: str) -> None:
    seen = any(np.abs(problem.sensitivities([c])).max() > 0 for problem, c in candidates(kind))
    assert seen, f"{_file(kind)}: write, hook or torque_at: it changes no prediction"


@pytest.mark.parametrize("kind", SEARCHED)
def test_what_is_screened_by_a_torque_has_one(kind: str) -> None:
    """A column from the torque's signature, not of zeros."""
    by_torque = [(p, c) for p, c in candidates(kind) if not (is_simulated(c, count(p)) or shortlisted(c, count(p)))]
    columns = (screen(p, [c], [], pulse_sizes(p, np.ones(count(p))))[0].values for p, c in by_torque)
    told = f'{_file(kind)}: torque, or column="simulated"'
    assert not by_torque or any(np.abs(values).max() > 0 for values in columns), told


def count(problem: Problem) -> int:
    return len(problem.plant.joints)


@pytest.mark.parametrize("kind", SEARCHED)
def test_every_effect_has_an_experiment_that_separates_it(kind: str) -> None:
    assert CATALOGUE[kind].experiment, f"{_file(kind)}: experiment: how it is told from what looks the same"


@pytest.mark.parametrize("kind", [k for k in SEARCHED if CATALOGUE[k].on == "joint"])
def test_the_declared_value_of_an_effect_on_a_joint_is_known(kind: str) -> None:
    problem, _ = robots()["arm"]
    values = declared_values(problem.plant, kind, problem.plant.joints[0])
    assert len(values) == len(CATALOGUE[kind].parameters)


def test_the_guide_is_what_the_effects_say() -> None:
    assert (HOME / "docs/effects.md").read_text() == page(), "python -m bumblebee.effects.guide > docs/effects.md"


@pytest.mark.parametrize("kind", [name for name, kind in CATALOGUE.items() if kind.added])
def test_a_model_varied_in_place_is_the_one_that_the_spec_makes(kind: str) -> None:
    """Every array of the compiled model, but what `Variation` has beside it: delays, and what belongs to them."""
    compared = 0
    for problem, c in candidates(kind) if kind in SEARCHED else []:
        effect, spec = c.at(c.start), problem.plant.spec.copy()
        add_to_spec(spec, [effect])
        made, varied = spec.compile(), vary(problem.plant, [effect]).model
        for name in _arrays(made):
            told = f"{_file(kind)}: write: {name} after {effect}"
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
            told = f"{_file(kind)}: beside = ({o.effect!r},)"
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
    for c in {c.effect: c for c in every if CATALOGUE[c.effect].hooks}.values():
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
    forgotten = changed - {f"_{name}" for name in REMEMBERED}
    assert not forgotten, f"bumblebee/sim/effects/forces.py: add {sorted(forgotten)} to REMEMBERED"
    assert {"_time", "_heat", "_lagged", "_past_q"} <= changed


@pytest.mark.parametrize("kind", SEARCHED)
def test_every_effect_has_an_equation_from_another_hand(kind: str) -> None:
    written = "".join(path.read_text() for room in ("sim", "effects") for path in (HOME / "tests" / room).glob("*.py"))
    assert f'"{kind}"' in written, f"tests/effects/test_{kind}.py: its equation, integrated in NumPy"
    told = f"bumblebee/stand_in/undeclared: a file with a law of {kind}, sharing no code, and its row in KINDS"
    assert kind in KINDS or kind in NOT_DRAWN, told


def _file(kind: str) -> str:
    return str(Path(inspect.getfile(type(CATALOGUE[kind]))).relative_to(HOME))
