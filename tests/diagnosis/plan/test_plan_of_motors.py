"""Drives that take torque, slides, joints without a drive, and what a diagnosis of another robot says."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from bumblebee.diagnosis.plan import PlanConfig, findings_of, make_plan, set_stage
from bumblebee.diagnosis.plan.written.document import document
from bumblebee.errors import BadInput
from bumblebee.sim.effects import single
from tests.diagnosis.arm import XML
from tests.diagnosis.cart import xml
from tests.diagnosis.plan.made import LIMITS, entry, slow_session

CART = PlanConfig(
    runs=2, seconds=5.0, pool=6, speed={"": 3.0, "cart": 1.5}, travel={"cart": 0.3, "pole": 0.8}, torque={"pole": 8.0}
)


def test_torque_drives_are_followed_by_a_servo_that_the_plan_states() -> None:
    plan = make_plan(mujoco.MjSpec.from_string(xml("motor")), "cart.xml", CART)
    told = document(plan, "")
    assert plan.machine.tracked
    assert min(told["command"]["kp"]) > 0 and min(told["command"]["kd"]) > 0
    assert "joint_torque_cmd" in told["command"]["follow"]
    assert all(run["kp"] == told["command"]["kp"] for run in told["runs"])
    assert told["units"]["cart"]["torque"] == "N"
    assert told["limits"]["joints"]["cart"]["torque"] == pytest.approx(0.9 * 300.0)


def test_told_gains_are_the_ones_that_follow() -> None:
    spec = mujoco.MjSpec.from_string(xml("motor"))
    machine = set_stage(spec, "cart.xml", replace(CART, kp=50.0, kd=5.0), None, None).machine
    np.testing.assert_allclose(machine.kp, 50.0)
    np.testing.assert_allclose(machine.kd, 5.0)


def test_a_motor_without_a_limit_is_asked_for_one() -> None:
    with pytest.raises(BadInput, match="--torque"):
        make_plan(mujoco.MjSpec.from_string(xml("motor")), "cart.xml", replace(CART, torque={}))


def test_a_joint_without_a_drive_gets_no_targets_and_keeps_its_range() -> None:
    text = xml("motor").replace('<motor name="pole" joint="pole" gear="2"/>', "")
    text = text.replace('axis="0 1 0" damping="0.02"', 'axis="0 1 0" damping="0.02" limited="true" range="-.3 .3"')
    plan = make_plan(mujoco.MjSpec.from_string(text), "cart.xml", replace(CART, travel={"cart": 0.3}, torque={}))
    pole = plan.machine.joints.index("pole")
    assert not plan.machine.moved[pole]
    for motion in plan.motions:
        assert np.ptp(motion.targets[:, pole]) == 0
    assert plan.reached[:, 0, pole].max() <= 1.0
    assert plan.reached[:, 0, pole].max() > 0.05


def test_a_diagnosis_of_another_robot_is_refused() -> None:
    told = {"schema": 1, "effects": [entry("viscous_friction", "elbow", 0.4, 0.1, [], "damping")]}
    found = findings_of(told, [single("viscous_friction", "elbow", 0.4)])
    with pytest.raises(BadInput, match="elbow"):
        make_plan(mujoco.MjSpec.from_string(XML), "arm.xml", LIMITS, slow_session(), found)


def test_an_interval_without_an_end_reaches_beyond_the_effect() -> None:
    told = entry("viscous_friction", "j2", 0.4, 0.1, [], "damping")
    told["parameters"]["damping"]["ci95"] = [None, None]
    finding = findings_of({"effects": [told]}, [single("viscous_friction", "j2", 0.4)]).listed[0]
    (_, low), (_, high) = finding.ends(2.0)
    assert low.value() == 0.0 and high.value() == pytest.approx(0.8)


def test_every_parameter_has_the_ends_of_its_interval() -> None:
    told = entry("joint_spring", "j2", 3.0, 1.0, [], "stiffness")
    told["parameters"]["preload"] = {"value": 0.5, "ci95": [-4.0, 4.0], "nominal": 0.0, "unit": "N m"}
    finding = findings_of({"effects": [told]}, [single("joint_spring", "j2", 3.0, 0.5)]).listed[0]
    ends = {name: effect.values() for name, effect in finding.ends(2.0)}
    assert ends == {
        "lower end of its interval": (2.0, 0.5),
        "upper end of its interval": (4.0, 0.5),
        "lower end of its preload": (3.0, -4.0),
        "upper end of its preload": (3.0, 4.0),
    }


def test_a_gain_at_which_the_robot_may_not_rest_is_left_out_and_the_robot_is_not() -> None:
    """With 1.8 kg the upright arm needs more than a tenth of its kp to stay so; declared it needs less."""
    told = entry("link_mass", "l3", 1.0, 0.8, [], "mass")
    told["parameters"]["mass"]["nominal"] = 0.7
    found = findings_of({"effects": [told]}, [single("link_mass", "l3", 1.0)])
    config = replace(LIMITS, gains=(1.0, 0.1), speed={"": 9.0})
    stage = set_stage(mujoco.MjSpec.from_string(XML), "arm.xml", config, None, found)
    assert stage.restless["kp x 0.1"].startswith("link mass l3 at the upper end") and any(
        "upper end" in case.name for case in stage.cases
    )
