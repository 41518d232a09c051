"""The stand-in: nothing undeclared without effects, and each effect against its own equation of motion.

Effects on joints are tested in free fall, where the joints are weightless and touch nothing: what changes a joint's
speed is then its own torque times the inverse mass matrix of the declared model.
"""

import mujoco
import numpy as np
import pytest

from bumblebee.deploy.robots import NominalRobots, SideBySide
from bumblebee.deploy.stand_in_effects import PARAMETERS, SealedEffects, to_arrays
from bumblebee.deploy.stand_in_robots import StandInRobots
from bumblebee.robot.facts import joint_names
from bumblebee.robot.model import build_model

KNEE = joint_names().index("left_knee_joint")
ELBOW = joint_names().index("right_elbow_joint")
ONE = np.array([0])


def effect(kind: str, where: str, value: float) -> dict:
    return {"effect": kind, "where": [where], "parameters": {PARAMETERS[kind]: value}}


def in_the_air(effects: list[dict], servo: bool = True, joint: int = KNEE, speed: float = 0.0) -> StandInRobots:
    """One robot 5 m up, at rest but for one joint; its servos hold where they are, or are switched off."""
    robots = StandInRobots(1, effects)
    if not servo:
        robots.kp[:] = robots.kd[:] = 0.0
    qpos, qvel = standing()
    qpos[:, 2] += 5.0
    qvel[:, 6 + joint] = speed
    robots.reset(qpos, qvel, qpos[:, 7:])
    return robots


def standing() -> tuple[np.ndarray, np.ndarray]:
    return build_model().key("stand").qpos[None].copy(), np.zeros((1, 29))


def inverse_mass(joint: int, armature: float = 0.0) -> float:
    """(M^-1)_jj of the declared model in the stand [1/(kg m^2)], with armature added to that joint."""
    model = build_model()
    model.dof_armature[6 + joint] += armature
    data = mujoco.MjData(model)
    data.qpos[:] = model.key("stand").qpos
    mujoco.mj_forward(model, data)
    unit = np.zeros((1, model.nv))
    unit[0, 6 + joint] = 1.0
    solved = np.zeros_like(unit)
    mujoco.mj_solveM(model, data, solved, unit)
    return float(solved[0, 6 + joint])


def speed_change(effects: list[dict], milliseconds: int, speed: float, joint: int = KNEE) -> float:
    """What the effects add to a coasting joint's speed, servos off, [rad/s]."""
    ends = []
    for these in (effects, []):
        robots = in_the_air(these, servo=False, joint=joint, speed=speed)
        robots.step(ONE, np.zeros((1, 23)), milliseconds)
        ends.append(robots.read().joint_vel[0, joint])
    return float(ends[0] - ends[1])


def test_without_effects_it_is_mujocos_own_servo_at_the_same_step() -> None:
    """40 ms of a disturbed stand: equal to MuJoCo's position actuators, Euler, 1 ms, but for rounding."""
    model = build_model()
    model.opt.timestep, model.opt.integrator = 0.001, mujoco.mjtIntegrator.mjINT_EULER
    data, (qpos, qvel) = mujoco.MjData(model), standing()
    qvel[0, 6:] = np.random.default_rng(0).normal(0, 0.5, 23)
    data.qpos[:], data.qvel[:], data.ctrl[:] = qpos[0], qvel[0], qpos[0, 7:]
    robots = StandInRobots(1, [])
    robots.reset(qpos, qvel, qpos[:, 7:])
    robots.step(ONE, qpos[:, 7:], 40)
    mujoco.mj_step(model, data, 40)
    assert np.allclose(robots.read().joint_pos[0], data.qpos[7:], atol=1e-6)
    assert np.allclose(robots.read().base_pos[0], data.qpos[:3], atol=1e-6)


def test_without_effects_a_stand_is_the_declared_models() -> None:
    """Half a second of standing: within 1 mrad and 1 mm of the nominal 5 ms model."""
    qpos, qvel = standing()
    ends = []
    for robots in (StandInRobots(1, []), NominalRobots(1, threads=1)):
        robots.reset(qpos, qvel, qpos[:, 7:])
        for _ in range(25):
            robots.step(ONE, qpos[:, 7:])
        ends.append(robots.read())
    assert np.allclose(ends[0].joint_pos, ends[1].joint_pos, atol=1e-3)
    assert np.allclose(ends[0].base_pos, ends[1].base_pos, atol=1e-3)
    assert ends[0].foot_force[0, :, 2].sum() == pytest.approx(33.34 * 9.81, rel=0.05)


def test_coulomb_friction_slows_a_coasting_joint_by_its_torque() -> None:
    expected = -1.5 * inverse_mass(KNEE) * 0.02
    assert speed_change([effect("coulomb_friction", "left_knee_joint", 1.5)], 20, 3.0) == pytest.approx(
        expected, rel=0.05
    )
    assert speed_change([effect("coulomb_friction", "left_knee_joint", 1.5)], 20, -3.0) == pytest.approx(
        -expected, rel=0.05
    )


def test_coulomb_friction_holds_a_joint_that_its_servo_pulls_too_little() -> None:
    """A target 0.01 rad away asks for 1 N m at the knee: 2 N m of friction hold it to 0.1 mrad."""
    robots = in_the_air([effect("coulomb_friction", "left_knee_joint", 2.0)])
    target = robots.read().joint_pos.copy()
    before = target[0, KNEE]
    target[0, KNEE] += 0.01
    for _ in range(10):
        robots.step(ONE, target)
    assert abs(robots.read().joint_pos[0, KNEE] - before) < 1e-4


def test_viscous_friction_slows_in_proportion_to_speed() -> None:
    for speed in (2.0, 4.0):
        expected = -0.8 * speed * inverse_mass(KNEE) * 0.005
        assert speed_change([effect("viscous_friction", "left_knee_joint", 0.8)], 5, speed) == pytest.approx(
            expected, rel=0.08
        )


def test_armature_is_the_joints_whole_rotor_inertia() -> None:
    """First millisecond after a target step: speed = kp step M^-1 dt with the changed armature in M."""
    declared = float(build_model().dof_armature[6 + KNEE])
    robots = in_the_air([effect("armature", "left_knee_joint", 3 * declared)])
    target = robots.read().joint_pos.copy()
    target[0, KNEE] += 0.1
    robots.step(ONE, target, 1)
    expected = robots.kp[KNEE] * 0.1 * inverse_mass(KNEE, 2 * declared) * 0.001
    assert robots.read().joint_vel[0, KNEE] == pytest.approx(expected, rel=1e-3)


def test_a_weak_motor_gives_less_than_its_drive_reports() -> None:
    robots = in_the_air([effect("motor_strength", "right_elbow_joint", 0.7)])
    target = robots.read().joint_pos.copy()
    target[0, ELBOW] += 0.1
    robots.step(ONE, target, 1)
    asked = robots.kp[ELBOW] * 0.1
    assert robots.read().joint_vel[0, ELBOW] == pytest.approx(0.7 * asked * inverse_mass(ELBOW) * 0.001, rel=1e-3)
    assert robots.read().joint_torque[0, ELBOW] == pytest.approx(asked)


@pytest.mark.parametrize("late", [1, 7, 20, 33])
def test_a_delay_of_n_milliseconds_shifts_the_response_by_n(late: int) -> None:
    delayed = in_the_air([effect("command_delay", "left_knee_joint", late / 1000)])
    prompt = in_the_air([])
    target = prompt.read().joint_pos.copy()
    target[0, KNEE] += 0.2
    delayed.step(ONE, target, late)
    assert abs(delayed.read().joint_vel[0, KNEE]) < 1e-9
    delayed.step(ONE, target, 15)
    prompt.step(ONE, target, 15)
    assert delayed.read().joint_pos[0] == pytest.approx(prompt.read().joint_pos[0], abs=1e-9)


def test_an_encoder_offset_shifts_the_equilibrium_and_hides_itself() -> None:
    robots = in_the_air([effect("encoder_offset", "right_elbow_joint", 0.05)])
    target = standing()[0][:, 7:]
    for _ in range(20):
        robots.step(ONE, target)
    reading = robots.read().joint_pos[0, ELBOW]
    truth = robots.batch.bind("qpos")[0, 7 + ELBOW]
    assert reading == pytest.approx(target[0, ELBOW], abs=2e-3)
    assert truth == pytest.approx(target[0, ELBOW] - 0.05, abs=2e-3)


def test_link_mass_is_weighed_by_the_feet() -> None:
    robots, (qpos, qvel) = StandInRobots(1, [effect("link_mass", "torso_link", 12.0)]), standing()
    robots.reset(qpos, qvel, qpos[:, 7:])
    weights = []
    for _ in range(20):
        robots.step(ONE, qpos[:, 7:])
        weights.append(robots.read().foot_force[0, :, 2].sum())
    declared = build_model()
    more = 12.0 - declared.body("torso_link").mass[0]
    assert np.mean(weights[5:]) == pytest.approx((declared.body_subtreemass[1] + more) * 9.81, rel=0.02)


def test_effects_fall_on_the_joints_that_are_named() -> None:
    model = build_model()
    arrays = to_arrays(
        [effect("viscous_friction", "left_knee_joint", 0.5), effect("encoder_offset", "right_elbow_joint", -0.1)], model
    )
    assert isinstance(arrays, SealedEffects)
    assert np.flatnonzero(arrays.viscous).tolist() == [KNEE] and np.flatnonzero(arrays.offset).tolist() == [ELBOW]
    assert not arrays.coulomb.any() and np.all(arrays.strength == 1)


def test_robots_side_by_side_are_the_same_robots() -> None:
    """Three robots in two parts move as three in one, also when one of them is left out of a step."""
    qpos, qvel = (np.repeat(a, 3, axis=0) for a in standing())
    qvel[:, 6:] = np.random.default_rng(0).normal(0, 1.0, (3, 23))
    ends = []
    for robots in (StandInRobots(3, []), SideBySide(lambda count: StandInRobots(count, []), 3, 2)):
        robots.reset(qpos, qvel, qpos[:, 7:])
        robots.step(np.arange(3), qpos[:, 7:])
        robots.step(np.array([0, 2]), qpos[[0, 2], 7:] + 0.1)
        ends.append(robots.read())
    assert np.allclose(ends[0].joint_pos, ends[1].joint_pos, atol=1e-12)
