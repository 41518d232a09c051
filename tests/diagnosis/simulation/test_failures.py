"""A model that cannot be made or simulated costs itself and nothing else, and is written down."""

import mujoco
import numpy as np
import pytest

import bumblebee.diagnosis.simulation.simulate as simulate
from bumblebee.diagnosis.candidates import Candidate, all_candidates
from bumblebee.diagnosis.dataset import Session
from bumblebee.diagnosis.replay import replay
from bumblebee.diagnosis.residuals import make_problem
from bumblebee.diagnosis.simulation import choose_starts, cut, residuals, vary
from bumblebee.diagnosis.thresholds import Thresholds
from bumblebee.errors import BadInput
from bumblebee.sim.effects import SUFFIX, single
from tests.diagnosis import arm, cart

BLOCK = """<mujoco><option timestep=".002"/><worldbody><body name="block"><joint name="rail" type="slide" axis="1 0 0"/>
<inertial pos="0 0 0" mass="2" diaginertia=".02 .03 .04"/></body></worldbody>
<actuator><motor joint="rail" gear="1"/></actuator></mujoco>"""
SHAFT = single("series_elasticity", "j2", 300.0, 1.0, 1e-3)
PLAY = single("backlash", "j2", 0.02, 1.0)


@pytest.fixture(scope="module")
def session() -> Session:
    return arm.session_of(arm.simulate({}, count=2, seconds=2.0), arm.XML)


def _windows(session: Session):
    starts = choose_starts(session.rollouts, [0, 1], 0.2, 8)
    return cut(session.plant, session.layout, session.rollouts, starts)


def _problem(session: Session):
    steps = (session.search_step, session.steps[1])
    rng = np.random.default_rng(0)
    return make_problem(session.plant, session.layout, _windows(session), session.sigma, steps, [], rng)


def _with_fresh_failures(session: Session) -> Session:
    session.plant.failures.reasons.clear()
    return session


def test_a_body_alone_on_a_slide_may_get_another_centre_of_mass() -> None:
    """MuJoCo compiles such a body as `simple` and would then refuse to move its centre."""
    time = np.arange(50) / 50
    zeros = np.zeros((50, 1))
    rollout = cart.Rollout("r", ("rail",), 50.0, time, zeros, zeros, joint_torque_cmd=zeros)
    plant = arm.session_of([rollout], BLOCK).plant
    assert mujoco.MjModel.from_xml_string(BLOCK).body_simple[1] and not plant.model.body_simple[1]
    moved = vary(plant, [single("link_com", "block", 0.1, 0.0, 0.2)])
    assert not moved.impossible and moved.model.body_ipos[1].tolist() == [0.1, 0.0, 0.2]
    assert plant.failures.reasons == {}


def test_a_combination_that_mjcf_cannot_hold_is_infinitely_bad_alone(session: Session) -> None:
    session = _with_fresh_failures(session)
    problem = _problem(session)
    friction = single("coulomb_friction", "j1", 0.1)
    declared, both, rubbed = problem.residual([[], [PLAY, SHAFT], [friction]])
    assert (both == problem.thresholds.residuals.outliers.impossible).all()
    np.testing.assert_array_equal(np.stack([declared, rubbed]), _problem(session).residual([[], [friction]]))
    (note,) = session.plant.failures.notes(5)
    assert "series_elasticity" in note and "backlash" in note and "one of play and shaft" in note


def test_what_an_impossible_model_would_change_is_nothing(session: Session) -> None:
    problem = _problem(session)
    change = problem.differences([], [[PLAY, SHAFT], [single("viscous_friction", "j1", 0.5)]], coarse=False)
    assert not change[0].any() and change[1].any()


def test_a_shaft_is_screened_beside_a_play_that_it_could_replace_without_both_at_once(session: Session) -> None:
    session = _with_fresh_failures(session)
    problem = _problem(session)
    shaft = Candidate("series_elasticity", "j2", (0.0,) * 4, (1e-2, 1.0, 1e-3, 0.0))
    alone, beside = problem.columns(shaft), problem.columns(shaft, [PLAY])
    np.testing.assert_array_equal(alone, beside)
    assert alone.any() and session.plant.failures.reasons == {}


def test_a_simulation_that_is_refused_costs_its_own_model_alone(
    session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    session, run = _with_fresh_failures(session), simulate._run
    heavy = single("viscous_friction", "j1", 7.0)

    def refuse(chunk, layout, inputs):
        if any(heavy in v.effects for v in chunk.chosen):
            raise mujoco.FatalError("mj_step: out of its mind")
        return run(chunk, layout, inputs)

    monkeypatch.setattr(simulate, "_run", refuse)
    models = [vary(session.plant, e) for e in ([], [heavy], [single("viscous_friction", "j1", 0.1)])]
    raw = residuals(session.plant, session.layout, _windows(session), models, session.steps[0])
    assert np.isfinite(raw[[0, 2]]).all() and np.isnan(raw[1]).all()
    assert ["out of its mind" in note for note in session.plant.failures.notes(5)] == [True]


def test_a_declared_model_that_cannot_be_simulated_ends_it_in_one_line(
    session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*args):
        raise mujoco.FatalError("mj_step: out\nof its mind")

    monkeypatch.setattr(simulate, "_run", refuse)
    with pytest.raises(BadInput, match=r"declared model.*out of its mind"):
        residuals(session.plant, session.layout, _windows(session), [vary(session.plant, [])], session.steps[0])


def test_effects_that_a_user_demands_are_refused_in_one_line(session: Session) -> None:
    with pytest.raises(BadInput, match="one of play and shaft"):
        replay(session, [PLAY, SHAFT])


def test_many_failures_are_few_lines() -> None:
    session = arm.session_of(arm.simulate({}, count=1, seconds=1.0), arm.XML)
    for k in range(9):
        session.plant.failures.add([single("armature", f"j{k}", 0.1)], ValueError("no"))
    notes = session.plant.failures.notes(3)
    assert len(notes) == 4 and notes[-1].startswith("6 more")


def test_play_and_shafts_are_offered_only_where_mjcf_has_room_for_a_second_hinge() -> None:
    """The first of two joints on one body has none."""
    crossed = cart.xml().replace('<body name="pole">', "").replace("</body></body>", "</body>")
    crossed = crossed.replace('<inertial pos="0 0 0" mass="2" diaginertia=".02 .02 .02"/>', "")
    session = cart.session_of(cart.record(count=1, seconds=2.0), crossed)
    rules = Thresholds().candidates
    offered = [c for c in all_candidates(session.plant, session.rollouts, [], rules) if c.effect in SUFFIX]
    assert {c.where for c in offered} == {"pole"}
    assert not any(vary(session.plant, [c.at(c.start)]).impossible for c in offered)
