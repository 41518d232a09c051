"""Which robots a plan is rehearsed on once a diagnosis has spoken: those that the data do not speak against."""

from dataclasses import replace
from functools import cache

import mujoco
import numpy as np
import pytest

from bumblebee.diagnosis.plan import Plan, findings_of, make_plan, set_stage
from bumblebee.diagnosis.plan.contacts import Surroundings
from bumblebee.diagnosis.plan.safety import made_safe, proven
from bumblebee.diagnosis.plan.written.document import document
from bumblebee.errors import BadInput
from bumblebee.sim.effects import Effect, single
from tests.diagnosis.arm import XML, session_of, simulate
from tests.diagnosis.plan.made import LIMITS, entry, planned, slow_session
from tests.diagnosis.plan.test_plan_is_safe import follow

WIDE = "viscous friction j2 at the upper end of its interval"
STIFF = XML.replace('joint="j3" kp="30" kv="2"', 'joint="j3" kp="3000" kv="200"')
TOP, TIP = 1.62, (0.0, 0.0, 0.25)


def found(value: float, half: float) -> tuple[dict, list]:
    """Viscous friction on j2, its interval of a half-width."""
    told = entry("viscous_friction", "j2", value, half, [], "damping")
    return {"schema": 1, "effects": [told]}, [single("viscous_friction", "j2", value)]


@cache
def of_stiff() -> Plan:
    """A plan for an arm whose file says many hundred times the gains that its third servo has."""
    factors = {"kp": 0.002, "kd": 0.002}
    told = [entry(k, "j3", v, 0.0001, [], "factor") for k, v in factors.items()]
    findings = findings_of({"schema": 1, "effects": told}, [single(k, "j3", v) for k, v in factors.items()])
    session = session_of(simulate({("motor_strength", "j3"): 0.2}, count=2, seconds=3.0, seed=1), STIFF)
    return make_plan(mujoco.MjSpec.from_string(STIFF), "arm.xml", LIMITS, session, findings)


def test_an_end_of_an_interval_that_the_data_speak_against_is_left_out_with_its_reason() -> None:
    plan = make_plan(mujoco.MjSpec.from_string(XML), "arm.xml", LIMITS, slow_session(), findings_of(*found(0.4, 40.0)))
    told = document(plan, "")
    assert WIDE in told["left_out"] and WIDE not in told["safe_on"]
    assert any(WIDE in note and "explains the data far worse" in note for note in told["notes"])


def test_ends_that_the_data_allow_are_rehearsed_on() -> None:
    plan = planned()
    assert not plan.left_out
    assert {case.name for case in plan.cases} > {"the declared model", "the diagnosed model", WIDE}


def test_ends_that_are_the_diagnosed_robot_again_are_not_simulated_twice() -> None:
    plan = make_plan(mujoco.MjSpec.from_string(XML), "arm.xml", LIMITS, slow_session(), findings_of(*found(0.4, 1e-4)))
    assert [case.name for case in plan.cases] == ["the declared model", "the diagnosed model"]


def test_a_declared_robot_that_is_not_this_one_does_not_hold_the_plan_back() -> None:
    plan = of_stiff()
    assert "the declared model" in plan.left_out
    used = np.max([np.abs(m.targets - plan.machine.home)[:, 2].max() for m in plan.motions])
    assert used > 0.1, "3000 N m/rad reach the limit of 20 N m within 0.007 rad"


def test_such_a_plan_keeps_its_limits_on_the_true_robot() -> None:
    plan, model = of_stiff(), mujoco.MjModel.from_xml_string(XML)
    model.actuator_gainprm[2, 0], model.actuator_biasprm[2, 1:3] = 6.0, (-6.0, -0.4)  # a fifth of those of XML
    for motion in plan.motions:
        _, v, tau = follow(model, plan.machine.home, motion.targets)
        assert (np.abs(v) <= 1.02 * plan.limits.speed).all()
        assert (np.abs(tau) <= 1.02 * plan.limits.torque).all()


def test_what_was_made_smaller_passes_all_cases_as_it_is() -> None:
    stage = set_stage(mujoco.MjSpec.from_string(XML), "arm", LIMITS, None, None)
    narrow = replace(stage, limits=replace(stage.limits, speed=np.full(3, 0.5), torque=stage.limits.torque * 0.5))
    safe = proven(narrow, planned().motions)
    again = made_safe(narrow, safe.motions, stage.machine.steps[0])
    assert safe.motions and len(again.motions) == len(safe.motions)
    for one, other, reached in zip(safe.motions, again.motions, safe.reached, strict=True):
        np.testing.assert_array_equal(one.amplitude, other.amplitude)
        assert (reached <= 1.0).all()
    assert any((m.amplitude < o.amplitude).any() for m, o in zip(safe.motions, planned().motions, strict=True))


def test_a_hand_keeps_clear_of_the_surface_that_a_diagnosis_found() -> None:
    table = Effect("surface_contact", ("l3",), {"height": TOP, "x": TIP[0], "y": TIP[1], "z": TIP[2], "friction": 1.0})
    findings = findings_of({"schema": 1, "effects": []}, [table])
    config = replace(LIMITS, pool=16, runs=3)
    stage = set_stage(mujoco.MjSpec.from_string(XML), "arm", config, slow_session(), findings)
    bare = Surroundings(stage.machine.plant, stage.machine.qpos, LIMITS.thresholds.plan.safety)
    low, high = [np.array([0.0, a, a])[None] for a in (1.2, 0.0)]
    still = np.zeros((1, 3))
    assert bare.clash(low, still, still) is None and stage.around.clash(high, still, still) is None
    assert "l3 comes too near to the surface" in stage.around.clash(low, still, still).reason
    plan = make_plan(mujoco.MjSpec.from_string(XML), "arm", config, slow_session(), findings)
    model = mujoco.MjModel.from_xml_string(XML)
    data, heights = mujoco.MjData(model), []
    for motion in plan.motions:
        for q in follow(model, plan.machine.home, motion.targets)[0]:
            data.qpos[:] = q
            mujoco.mj_kinematics(model, data)
            heights.append(data.xpos[3, 2] + data.xmat[3, 6:9] @ np.array(TIP))
    assert min(heights) > TOP


def test_gains_at_which_the_robot_does_not_rest_are_left_out_with_a_note() -> None:
    """Upright, the arm needs 4.4 N m/rad at j2 to stay so: a twentieth of its 60 lets it fall over."""
    config = replace(LIMITS, gains=(0.05, 1.0), speed={"": 9.0})
    plan = make_plan(mujoco.MjSpec.from_string(XML), "arm.xml", config)
    assert list(plan.restless) == ["kp x 0.05"]
    assert {motion.gain.kp for motion in plan.motions} == {1.0}
    assert any(note.startswith("no run at kp x 0.05") for note in document(plan, "")["notes"])


def test_where_no_gain_that_was_asked_for_is_left_there_is_no_plan() -> None:
    config = replace(LIMITS, gains=(0.05,), speed={"": 9.0})
    with pytest.raises(BadInput, match="at which the robot rests") as caught:
        make_plan(mujoco.MjSpec.from_string(XML), "arm.xml", config)
    assert "kp x 0.05" in str(caught.value)
