"""A plan keeps its limits on every robot that it may be: by a simulation of the test's own, step by step."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from bumblebee.diagnosis.plan import PlanConfig, make_plan, set_stage
from bumblebee.diagnosis.plan.contacts import Clash, Surroundings, inner_radius, inside_by
from bumblebee.diagnosis.plan.motions import draw_motion, smooth_step
from bumblebee.diagnosis.plan.safety import made_safe
from bumblebee.errors import BadInput
from bumblebee.sim.effects import add_to_spec, single
from tests.diagnosis.arm import XML
from tests.diagnosis.plan.made import LIMITS, planned
from tests.diagnosis.stander import XML as STANDER

FRICTION = {"low": 0.3, "found": 0.4, "high": 0.5, "none": 0.0}


def follow(model: mujoco.MjModel, home: np.ndarray, targets: np.ndarray, hz: float = 50.0) -> tuple[np.ndarray, ...]:
    """Positions, velocities (T, J) and forces (T, nu) of a robot that first rests at `home` for 2 s."""
    model.opt.timestep = 0.001
    data, steps = mujoco.MjData(model), round(1000 / hz)
    data.qpos[:], data.ctrl[:] = home, home
    mujoco.mj_step(model, data, 2000)
    rows = []
    for target in targets:
        data.ctrl[:] = target
        rows.append((data.qpos.copy(), data.qvel.copy(), data.actuator_force.copy()))
        mujoco.mj_step(model, data, steps)
    return tuple(np.array(column) for column in zip(*rows, strict=True))


@pytest.mark.parametrize("friction", FRICTION.values(), ids=FRICTION.keys())
def test_a_plan_keeps_its_limits_on_the_declared_robot_and_at_both_ends_of_the_interval(friction: float) -> None:
    plan = planned()
    model = mujoco.MjModel.from_xml_string(XML)
    model.dof_damping[1] = friction
    for motion in plan.motions:
        q, v, tau = follow(model, plan.machine.home, motion.targets)
        assert (q > plan.limits.low - 1e-3).all() and (q < plan.limits.high + 1e-3).all()
        assert (np.abs(v) <= 1.02 * plan.limits.speed).all()
        assert (np.abs(tau) <= 1.02 * plan.limits.torque).all()


def test_a_plan_keeps_its_speed_between_the_ticks_of_a_slow_rate() -> None:
    config = replace(LIMITS, rate=20.0, speed={"": 1.0}, travel={"": 1.4}, pool=24, runs=3, seconds=6.0)
    stage = set_stage(mujoco.MjSpec.from_string(XML), "arm", config, None, None)
    safe = made_safe(replace(stage, cases=stage.cases[:1]), [draw_motion(stage.scope, 0, k) for k in range(12)])
    model, home = mujoco.MjModel.from_xml_string(XML), stage.machine.home
    model.opt.timestep = 0.001
    assert len(safe.motions) > 3
    for motion in safe.motions:
        data, fastest = mujoco.MjData(model), 0.0
        data.qpos[:] = home
        for target in np.concatenate((np.tile(home, (40, 1)), motion.targets)):
            data.ctrl[:] = target
            for _ in range(50):
                mujoco.mj_step(model, data)
                fastest = max(fastest, np.abs(data.qvel).max())
        assert fastest < 1.0


def test_a_told_travel_does_not_take_the_ranges_margin() -> None:
    ranged = XML.replace("<joint name", '<joint range="-1.5 1.5" limited="true" name')
    plain, told = (
        set_stage(mujoco.MjSpec.from_string(ranged), "arm", replace(LIMITS, travel=travel), None, None).limits
        for travel in ({}, {"": 50.0})
    )
    np.testing.assert_array_equal(told.low, plain.low)
    np.testing.assert_array_equal(told.high, plain.high)
    assert (plain.high < 1.5).all()


def test_with_a_told_travel_a_run_may_start_at_a_stop() -> None:
    stopped = XML.replace("<joint name", '<joint range="0 1.5" limited="true" name')
    limits = set_stage(mujoco.MjSpec.from_string(stopped), "arm", replace(LIMITS, travel={"": 0.5}), None, None).limits
    np.testing.assert_array_equal(limits.low, np.zeros(3))
    np.testing.assert_array_equal(limits.high, np.full(3, 0.5))


def test_balance_is_that_of_the_robot_that_is_rehearsed() -> None:
    spec = mujoco.MjSpec.from_string(STANDER)
    config = PlanConfig(speed={"": 6.0}, travel={"": 2.5})
    stage = set_stage(spec, "stander", config, None, None)
    model, rest = stage.machine.plant.model, np.zeros((1, stage.machine.plant.model.nv))
    hold = np.zeros((1, len(stage.machine.home)))
    assert stage.around.clash(stage.machine.qpos[None], rest, hold) is None
    leaning = spec.copy()
    add_to_spec(leaning, [single("link_com", "trunk", 0.5, 0.0, 0.0)])
    clash = stage.around.weighing(leaning.compile()).clash(stage.machine.qpos[None], rest, hold)
    assert clash and "centre of mass" in clash.reason
    assert model.body("trunk").ipos[0] < 0.5


def test_bodies_that_are_near_at_the_start_do_not_touch() -> None:
    beside = BLOCKED.replace('pos=".35 0 1.2"', f'pos="{0.04 + 0.008 + 0.05} 0 1.2"')
    stage = set_stage(mujoco.MjSpec.from_string(beside), "arm", LIMITS, None, None)
    around = Surroundings(stage.machine.plant, np.zeros(3), LIMITS.thresholds.plan.safety)
    still = np.zeros((1, 3))
    assert around.clash(still, still, still) is None
    nearer = around.clash(np.array([[0.0, 0.02, 0.0]]), still, still)
    assert nearer and nearer.reason == "l3 and world come closer than 1 mm"


def test_the_limits_are_the_told_ones_less_their_margins() -> None:
    limits, rule = planned().limits, LIMITS.thresholds.plan.safety
    np.testing.assert_allclose(limits.speed, 4.0 * rule.speed)
    np.testing.assert_allclose(limits.torque, rule.torque * np.array([40.0, 40.0, 20.0]))
    assert (limits.high - limits.low <= 2.0 + 1e-9).all()


def test_runs_start_and_end_at_rest_in_the_start_pose() -> None:
    plan = planned()
    for motion in plan.motions:
        np.testing.assert_allclose(motion.targets[[0, 1, -2, -1]], np.tile(plan.machine.home, (4, 1)), atol=1e-9)
        speed = np.gradient(motion.targets, 0.02, axis=0)
        assert np.abs(speed[[0, -1]]).max() < 1e-6
        assert np.abs(np.gradient(speed, 0.02, axis=0)[[0, -1]]).max() < 1e-6
        assert np.abs(motion.targets - plan.machine.home).max() > 0.02


def test_a_ramp_has_no_speed_and_no_acceleration_at_its_ends() -> None:
    share = np.linspace(-0.2, 1.2, 1401)
    speed = np.gradient(smooth_step(share), share)
    assert smooth_step(share)[0] == 0 and smooth_step(share)[-1] == 1
    assert speed.min() > -1e-9 and np.abs(np.gradient(speed, share)).max() < 6.0


def test_a_motion_that_breaks_a_limit_is_made_smaller_and_then_keeps_it() -> None:
    stage = set_stage(mujoco.MjSpec.from_string(XML), "arm", LIMITS, None, None)
    narrow = replace(stage.limits, speed=np.full(3, 0.3))
    motions = [draw_motion(stage.scope, 0, k) for k in range(5)]
    safe = made_safe(replace(stage, limits=narrow), motions)
    assert safe.motions
    assert all((new.amplitude < motions[new.number].amplitude).any() for new in safe.motions)
    model = mujoco.MjModel.from_xml_string(XML)
    for motion in safe.motions:
        _, v, _ = follow(model, stage.machine.home, motion.targets)
        assert np.abs(v).max() <= 0.31


BLOCKED = XML.replace(
    "<worldbody>", '<worldbody><geom name="post" type="box" size=".05 .3 .5" pos=".35 0 1.2"/>'
).replace(
    '<inertial pos="0.01 0.02 .12" mass=".7" diaginertia=".005 .005 .001"/>',
    '<inertial pos="0.01 0.02 .12" mass=".7" diaginertia=".005 .005 .001"/>'
    '<geom name="tip" type="sphere" size=".04" pos="0 0 .2" mass="0"/>',
)  # fmt: skip


def test_runs_keep_clear_of_a_post_beside_the_arm() -> None:
    config = replace(LIMITS, pool=8, travel={"": 2.0})
    stage = set_stage(mujoco.MjSpec.from_string(BLOCKED), "arm", config, None, None)
    motions = [draw_motion(stage.scope, 0, k) for k in range(8)]
    model = mujoco.MjModel.from_xml_string(BLOCKED)
    home = stage.machine.home
    safe = made_safe(replace(stage, cases=stage.cases[:1]), motions, 0.005)
    assert any(near(model, follow(model, home, m.targets)[0]) <= 0 for m in motions)
    assert safe.motions
    clear = 0.9 * LIMITS.thresholds.plan.safety.clearance  # at a step of this test's own
    assert all(near(model, follow(model, home, m.targets)[0]) > clear for m in safe.motions)


def near(model: mujoco.MjModel, path: np.ndarray) -> float:
    """Least distance [m] of the tip from the post along a path (T, nq)."""
    data, least = mujoco.MjData(model), np.inf
    for qpos in path:
        data.qpos[:] = qpos
        mujoco.mj_kinematics(model, data)
        found = mujoco.mj_geomDistance(model, data, model.geom("tip").id, model.geom("post").id, 1.0, np.zeros(6))
        least = min(least, found)
    return least


def test_a_stander_keeps_its_feet_down_and_its_base_upright() -> None:
    config = PlanConfig(runs=1, seconds=4.0, pool=2, speed={"": 6.0}, travel={"": 2.5})
    plan = make_plan(mujoco.MjSpec.from_string(STANDER), "stander", config)
    assert plan.machine.plant.floating and len(plan.cases) > 3
    model = mujoco.MjModel.from_xml_string(STANDER)
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 400)
    feet = data.ncon
    for target in plan.motions[0].targets:
        data.ctrl[:] = target
        mujoco.mj_step(model, data, 4)
        assert data.xmat[1].reshape(3, 3)[2, 2] > np.cos(0.1)
        assert data.ncon == feet


def test_a_robot_that_falls_over_is_refused_in_one_line() -> None:
    falling = STANDER.replace('pos="-.12 .1 -.18"', 'pos=".11 .1 -.18"').replace(
        'pos="-.12 -.1 -.18"', 'pos=".11 -.1 -.18"'
    )
    with pytest.raises(BadInput, match="stands on the floor") as caught:
        make_plan(mujoco.MjSpec.from_string(falling), "stander", PlanConfig(speed={"": 2.0}, travel={"": 1.0}))
    assert "\n" not in str(caught.value) and "--start" in str(caught.value)


def test_surroundings_tell_a_far_arm_from_a_near_one() -> None:
    stage = set_stage(mujoco.MjSpec.from_string(BLOCKED), "arm", LIMITS, None, None)
    around = Surroundings(stage.machine.plant, stage.machine.qpos, LIMITS.thresholds.plan.safety)
    away, into = np.zeros(3), np.array([0.0, 0.9, 0.0])
    assert around.clash(away[None], away[None], away[None]) is None
    assert "l3" in around.clash(into[None], away[None], away[None]).reason


@pytest.mark.parametrize("tip", ["", '<geom type="sphere" size=".01" mass="0"/>'], ids=["one", "two geometries"])
@pytest.mark.parametrize(
    "kinds",
    ["", 'contype="0" conaffinity="1"', 'contype="0" conaffinity="0"'],
    ids=["awake", "for the floor alone", "pair"],
)
def test_bodies_that_come_closer_than_the_clearance_are_refused_before_they_touch(tip: str, kinds: str) -> None:
    """Also where the model lets the robot touch the floor alone, or by a named pair; on bodies of several shapes."""

    def clash(gap: float) -> Clash | None:
        beside = BLOCKED.replace('pos=".35 0 1.2"', f'pos="{0.04 + gap + 0.05} 0 1.2"')
        beside = beside.replace('<geom name="tip"', f'{tip}<geom name="tip"').replace("<geom ", f"<geom {kinds} ")
        pair = '<contact><pair geom1="tip" geom2="post"/></contact>'
        stage = set_stage(
            mujoco.MjSpec.from_string(beside.replace("<actuator>", f"{pair}<actuator>")), "arm", LIMITS, None, None
        )
        around = Surroundings(stage.machine.plant, np.array([0.0, -0.5, 0.0]), LIMITS.thresholds.plan.safety)
        upright = np.zeros((1, 3))
        return around.clash(upright, upright, upright)

    refused = clash(0.005)
    assert refused and refused.reason == "l3 and world come closer than 10 mm"
    assert clash(0.012) is None


def test_a_limit_is_what_the_drive_gives_both_ways() -> None:
    lopsided = XML.replace('forcerange="-20 20"', 'forcerange="-5 20"')
    stage = set_stage(mujoco.MjSpec.from_string(lopsided), "arm", LIMITS, None, None)
    assert stage.limits.torque[2] == pytest.approx(LIMITS.thresholds.plan.safety.torque * 5.0)


def test_a_drive_whose_torque_its_gains_do_not_tell_is_refused() -> None:
    last = '<position name="j3" joint="j3" kp="30" kv="2" forcerange="-20 20"/>'
    motor = '<dcmotor name="j3" joint="j3" motorconst=".5" resistance="1" input="pos" controller="40 0 2"/>'
    assert last in XML
    config = replace(LIMITS, torque={"j3": 20.0})
    with pytest.raises(BadInput, match=r"joint 'j3'.*dcmotor"):
        set_stage(mujoco.MjSpec.from_string(XML.replace(last, motor)), "arm", config, None, None)


def test_the_margin_of_support_is_the_distance_from_the_edge() -> None:
    square = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0], [1.0, 1.0]])
    assert inside_by(np.array([0.5, 1.0]), square) == pytest.approx(0.5)
    assert inside_by(np.array([2.5, 1.0]), square) == pytest.approx(-0.5)
    assert inner_radius(square) == pytest.approx(1.0)
    assert inside_by(np.array([0.0, 0.0]), square[:2]) == -np.inf
