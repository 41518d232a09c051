"""A first look names what a diagnosis would, with its size; where nothing is, it says so."""

from dataclasses import replace

import numpy as np
import pytest

from bumblebee.diagnosis.candidates import all_candidates
from bumblebee.diagnosis.quick import FirstLook, first_look, told
from bumblebee.diagnosis.selection import Lead, Leads, leads
from bumblebee.sim.quiet import quiet_mujoco
from tests.diagnosis import arm, cart
from tests.diagnosis.strange_arm import simulate
from tests.diagnosis.test_catalogue import CONFIG

WHOLE = "bumblebee diagnose MODEL.xml DATASET --out found"


@pytest.fixture(scope="module")
def look() -> FirstLook:
    return first_look(arm.session_of(simulate({("coulomb_friction", "j2"): (1.0,)}, seed=3)), CONFIG)


def test_the_first_lead_is_the_effect_that_is_there_with_its_size(look: FirstLook) -> None:
    first, alone = look.leads.alone[0], look.leads.alone
    assert (first.candidate.effect, first.candidate.where) == ("coulomb_friction", "j2")
    assert first.values[0] == pytest.approx(1.0, rel=0.1)
    assert first.explains > 0.8
    assert [lead.explains for lead in alone] == sorted((lead.explains for lead in alone), reverse=True)
    assert next(iter(look.report.document["missing_torque"])) == "j2"
    said = told(look, WHOLE)
    assert "furthest off: j2 " in said and "  j2: coulomb_friction frictionloss = " in said
    assert said.index("N m RMS") < said.index("coulomb_friction") < said.index(WHOLE)


def test_a_model_that_lacks_nothing_gets_no_lead() -> None:
    look = first_look(arm.session_of(simulate({}, seed=3)), CONFIG)
    assert look.leads.alone == look.leads.together == []
    said = told(look, WHOLE)
    assert "no effect of the catalogue is sure alone" in said and "RMS" not in said and WHOLE not in said


def test_an_effect_in_one_place_is_one_lead() -> None:
    """A heavier link is tested by its mass alone and with its inertia: both explain it."""
    look = first_look(arm.session_of(arm.simulate({("link_mass", "l3"): 1.2}, seed=3)), CONFIG)
    places = [(lead.candidate.effect, lead.candidate.where) for lead in look.leads.alone]
    assert ("link_mass", "l3") in places
    assert len(set(places)) == len(places)


def test_gains_that_are_wrong_on_all_joints_are_the_leads() -> None:
    """The firmware multiplies what it is told by four; no single effect passes for that."""
    look = first_look(arm.session_of(arm.simulate({("motor_strength", j): 4.0 for j in arm.JOINTS}, seed=3)), CONFIG)
    found = {(lead.candidate.effect, lead.candidate.where): lead.values[0] for lead in look.leads.together}
    for name in arm.JOINTS:
        strength = found.get(("motor_strength", name), 1.0)
        assert strength * found.get(("kp", name), 1.0) == pytest.approx(4.0, rel=0.25)
    assert look.leads.together[0].explains > 0.9 and look.leads.alone == []
    assert "standard parameters by inverse dynamics" in told(look, WHOLE) and "no effect" not in told(look, WHOLE)


def test_no_lead_is_on_a_joint_whose_residual_shows_nothing(look: FirstLook) -> None:
    m = look.report.torque.material
    found = leads(m.problem, m.holdout, m.remade, CONFIG.search, lambda text: None, 3, quiet=["j2"])
    several = [*found.alone, *found.together]
    assert several and "j2" not in {lead.candidate.where for lead in several}


def test_runs_too_short_for_a_window_are_reported_and_have_no_lead() -> None:
    look = first_look(arm.session_of(simulate({}, seed=3)), replace(CONFIG, horizon=60.0))
    assert look.report.torque is None and any("could not be tested" in note for note in look.notes)
    assert "too few windows to say" in told(look, WHOLE)


def test_a_model_that_is_far_off_without_a_lead_is_said_to_be_off_as_a_whole() -> None:
    """Springs a hundredfold too stiff and dampers a thousandfold."""
    declared = cart.xml().replace('damping="0.02"', 'damping="20"').replace('stiffness="40"', 'stiffness="4000"')
    quiet_mujoco()
    look = first_look(arm.session_of(cart.record(count=3), declared), CONFIG)
    said = told(replace(look, leads=Leads([], [])), WHOLE)
    assert "no effect of the catalogue is sure alone" not in said
    assert "times the noise floor" in said and "its drives, or the whole model, are off" in said
    assert said.index("are off") < said.index(WHOLE)


def test_a_lead_at_the_end_of_its_range_is_said_to_be_there() -> None:
    session = arm.session_of(cart.record(count=3), cart.xml())
    drive = next(c for c in all_candidates(session.plant, session.rollouts, []) if c.effect == "motor_strength")
    at_its_end = Leads([], [Lead(drive, np.array([1e-3]), 9.0, 0.5)])
    said = told(replace(first_look(session, CONFIG), leads=at_its_end), WHOLE)
    assert "motor_strength factor = 0.001, at the end of the values that are tried" in said


def test_masses_far_too_light_are_no_drives_without_strength() -> None:
    light = cart.xml().replace('mass="2"', 'mass=".05"').replace('mass=".6"', 'mass=".02"')
    light = light.replace(".01 .01 .001", ".0002 .0002 .0001")
    found = first_look(arm.session_of(cart.record(count=3), light), CONFIG).leads.together
    sizes = {(lead.candidate.effect, lead.candidate.where): float(lead.values[0]) for lead in found}
    assert sizes["armature", "cart"] == pytest.approx(2.5, rel=0.3)  # both masses ride on the slide
    assert not any(effect == "motor_strength" for effect, _ in sizes)
