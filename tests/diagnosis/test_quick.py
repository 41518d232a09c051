"""A first look names what a diagnosis would, with its size; where nothing is, it says so."""

from dataclasses import replace

import pytest

from bumblebee.diagnosis.quick import first_look, told
from tests.diagnosis import arm
from tests.diagnosis.strange_arm import simulate
from tests.diagnosis.test_catalogue import CONFIG


def test_the_first_lead_is_the_effect_that_is_there_with_its_size() -> None:
    look = first_look(arm.session_of(simulate({("coulomb_friction", "j2"): (1.0,)}, seed=3)), CONFIG)
    first = look.leads[0]
    assert (first.candidate.effect, first.candidate.where) == ("coulomb_friction", "j2")
    assert first.values[0] == pytest.approx(1.0, rel=0.1)
    assert first.explains > 0.8
    assert first.z > look.bound
    assert [lead.explains for lead in look.leads] == sorted((lead.explains for lead in look.leads), reverse=True)
    assert look.errors[0][0] == "j2"
    assert "coulomb_friction" in told(look)
    assert "N m" in told(look)


def test_a_model_that_lacks_nothing_gets_no_lead() -> None:
    look = first_look(arm.session_of(simulate({}, seed=3)), CONFIG)
    assert look.leads == []
    assert "no effect of the catalogue is sure alone" in told(look)
    failed = replace(look, notes=["not tried: armature on j1"])
    assert told(failed).endswith("note: not tried: armature on j1")


def test_an_effect_in_one_place_is_one_lead() -> None:
    """A heavier link is tested by its mass alone and with its inertia: both explain it."""
    look = first_look(arm.session_of(arm.simulate({("link_mass", "l3"): 1.2}, seed=3)), CONFIG)
    places = [(lead.candidate.effect, lead.candidate.where) for lead in look.leads]
    assert ("link_mass", "l3") in places
    assert len(set(places)) == len(places)


def test_gains_that_are_wrong_on_all_joints_are_the_leads() -> None:
    """The firmware multiplies what it is told by four; no single effect passes for that."""
    look = first_look(arm.session_of(arm.simulate({("motor_strength", j): 4.0 for j in arm.JOINTS}, seed=3)), CONFIG)
    found = {(lead.candidate.effect, lead.candidate.where): lead.values[0] for lead in look.together}
    for name in arm.JOINTS:
        strength = found.get(("motor_strength", name), 1.0)
        assert strength * found.get(("kp", name), 1.0) == pytest.approx(4.0, rel=0.1)
    assert look.together[0].explains > 0.9 and not any(lead.explains > 0.5 for lead in look.leads)
    assert "fitted together" in told(look) and "no effect" not in told(look)
