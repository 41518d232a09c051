"""A model varied in place is the one that the same effects make of the spec."""

import mujoco
import numpy as np
import pytest

from bumblebee.diagnosis.simulation.plant import make_plant
from bumblebee.diagnosis.simulation.variation import vary
from bumblebee.effects.native import HIDDEN_ARMATURE
from bumblebee.sim.effects import add_to_spec, single
from tests.diagnosis import arm

_SHAFTS = {"backlash": (0.02,), "series_elasticity": (300.0,)}
_REST = {"backlash": (), "series_elasticity": (1e-3,)}


@pytest.mark.parametrize("kind", _SHAFTS)
@pytest.mark.parametrize("encoder", [0.0, 1.0])
@pytest.mark.parametrize("armature", [None, 0.0, 1e-6, 0.03])
def test_a_rotor_has_the_armature_that_was_fitted(kind: str, encoder: float, armature: float | None) -> None:
    joint = arm.JOINTS[1]
    effects = [single(kind, joint, *_SHAFTS[kind], encoder, *_REST[kind])]
    if armature is not None:
        effects.append(single("armature", joint, armature))
    rollout = arm.simulate({}, count=1, seconds=0.5)[0]
    plant = make_plant(mujoco.MjSpec.from_string(arm.XML), rollout, "arm")
    spec = mujoco.MjSpec.from_string(arm.XML)
    add_to_spec(spec, effects)
    made, varied = spec.compile(), vary(plant, effects).model
    for field in ("tendon_armature", "dof_armature", "dof_M0"):
        np.testing.assert_allclose(getattr(varied, field), getattr(made, field), rtol=1e-9, err_msg=field)
    if encoder:
        declared = 0.01 if armature is None else armature
        assert varied.tendon_armature == pytest.approx([max(declared, HIDDEN_ARMATURE)])


@pytest.mark.parametrize("encoder", [0.0, 1.0])
@pytest.mark.parametrize("armature", [None, 0.03])
def test_what_of_a_rotor_turns_with_the_link_is_taken_from_it(encoder: float, armature: float | None) -> None:
    joint = arm.JOINTS[1]
    effects = [single("series_elasticity", joint, 300.0, encoder, 1e-3, 0.2)]
    if armature is not None:
        effects.append(single("armature", joint, armature))
    plant = make_plant(mujoco.MjSpec.from_string(arm.XML), arm.simulate({}, count=1, seconds=0.5)[0], "arm")
    spec = mujoco.MjSpec.from_string(arm.XML)
    add_to_spec(spec, effects)
    made, varied = spec.compile(), vary(plant, effects).model
    for field in ("tendon_armature", "dof_armature", "dof_M0"):
        np.testing.assert_allclose(getattr(varied, field), getattr(made, field), rtol=1e-9, err_msg=field)
    behind, whole = (0.8 if encoder else 0.2), armature or 0.01
    assert varied.tendon_armature == pytest.approx([behind * whole])
    assert varied.dof_armature[made.joint(joint).dofadr[0]] == pytest.approx((1 - behind) * whole)
    again = vary(plant, [single("series_elasticity", joint, 300.0, encoder, 1e-3, 0.4), *effects[1:]]).model
    assert again.tendon_armature == pytest.approx([(0.6 if encoder else 0.4) * whole])  # the same structure, varied


def test_a_weaker_drive_of_two_servos_is_weaker_in_both() -> None:
    second = '<position name="again" joint="j3" kp="20" kv="1"/></actuator>'
    spec = mujoco.MjSpec.from_string(arm.XML.replace("</actuator>", second))
    plant = make_plant(spec, arm.simulate({}, count=1, seconds=1.0)[0], "arm")
    weak = single("motor_strength", "j3", 0.5)
    written = spec.copy()
    add_to_spec(written, [weak])
    np.testing.assert_array_equal(vary(plant, [weak]).model.actuator_gainprm, written.compile().actuator_gainprm)
