"""The stand-in: nothing undeclared without effects, and each effect against its own equation of motion.

Effects on joints are tested in free fall, where the joints are weightless and touch nothing: what changes a joint's
speed is then its own torque times the inverse mass matrix of the declared model.
"""

import mujoco
import numpy as np
import pytest

from bumblebee.policy.robots import NominalRobots, SideBySide
from bumblebee.robot.facts import joint_names
from bumblebee.robot.model import build_model
from bumblebee.robot.servo_command import ServoCommand
from bumblebee.stand_in.body import StandInRobots
from bumblebee.stand_in.sealed import declared_g1, entry
from bumblebee.stand_in.undeclared.faults import largest, peaks
from bumblebee.stand_in.undeclared.kinds import KINDS, Place, fits, places
from bumblebee.stand_in.undeclared.law import World
from bumblebee.stand_in.undeclared.signals import DroppedCommands

KNEE = joint_names().index("left_knee_joint")
ELBOW = joint_names().index("right_elbow_joint")
ONE = np.array([0])


def spot(where: str, sign: int = 1) -> Place:
    drawn = {"sign": sign, "axis": 0, "number": 8, "other": "right_knee_joint"}
    return Place(declared_g1(), where, drawn, *peaks().get(where, (0.0, 0.0, 0.0)))


def effect(kind: str, where: str, size: float) -> dict:
    return entry(KINDS[kind], spot(where), size)


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
    """Change of a coasting joint's speed by the effects, servos off, [rad/s]."""
    ends = []
    for these in (effects, []):
        robots = in_the_air(these, servo=False, joint=joint, speed=speed)
        robots.step(ONE, ServoCommand(np.zeros((1, 23))), milliseconds)
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
    robots.step(ONE, ServoCommand(qpos[:, 7:]), 40)
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
            robots.step(ONE, ServoCommand(qpos[:, 7:]))
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
        robots.step(ONE, ServoCommand(target))
    assert abs(robots.read().joint_pos[0, KNEE] - before) < 1e-4


def test_viscous_friction_slows_in_proportion_to_speed() -> None:
    for speed in (2.0, 4.0):
        expected = -0.8 * speed * inverse_mass(KNEE) * 0.005
        assert speed_change([effect("viscous_friction", "left_knee_joint", 0.8)], 5, speed) == pytest.approx(
            expected, rel=0.08
        )


def test_armature_is_the_joints_whole_rotor_inertia() -> None:
    """First millisecond after a target step: speed = kp step M^-1 dt with the changed armature in M."""
    declared = float(build_model().dof_armature[6 + KNEE])  # and twice as much more
    robots = in_the_air([effect("armature", "left_knee_joint", 2.0)])
    target = robots.read().joint_pos.copy()
    target[0, KNEE] += 0.1
    robots.step(ONE, ServoCommand(target), 1)
    expected = robots.kp[KNEE] * 0.1 * inverse_mass(KNEE, 2 * declared) * 0.001
    assert robots.read().joint_vel[0, KNEE] == pytest.approx(expected, rel=1e-3)


def test_a_weak_motor_gives_less_than_its_drive_reports() -> None:
    robots = in_the_air([effect("motor_strength", "right_elbow_joint", 0.3)])
    target = robots.read().joint_pos.copy()
    target[0, ELBOW] += 0.1
    robots.step(ONE, ServoCommand(target), 1)
    asked = robots.kp[ELBOW] * 0.1
    assert robots.read().joint_vel[0, ELBOW] == pytest.approx(0.7 * asked * inverse_mass(ELBOW) * 0.001, rel=1e-3)
    assert robots.read().joint_torque[0, ELBOW] == pytest.approx(asked)


@pytest.mark.parametrize("late", [1, 7, 20, 33])
def test_a_delay_of_n_milliseconds_shifts_the_response_by_n(late: int) -> None:
    delayed = in_the_air([effect("command_delay", "left_knee_joint", late / 1000)])
    prompt = in_the_air([])
    target = prompt.read().joint_pos.copy()
    target[0, KNEE] += 0.2
    delayed.step(ONE, ServoCommand(target), late)
    assert abs(delayed.read().joint_vel[0, KNEE]) < 1e-9
    delayed.step(ONE, ServoCommand(target), 15)
    prompt.step(ONE, ServoCommand(target), 15)
    assert delayed.read().joint_pos[0] == pytest.approx(prompt.read().joint_pos[0], abs=1e-9)


def test_an_encoder_offset_shifts_the_equilibrium_and_hides_itself() -> None:
    robots = in_the_air([effect("encoder_offset", "right_elbow_joint", 0.05)])
    target = standing()[0][:, 7:]
    for _ in range(20):
        robots.step(ONE, ServoCommand(target))
    reading = robots.read().joint_pos[0, ELBOW]
    truth = robots.batch.bind("qpos")[0, 7 + ELBOW]
    assert reading == pytest.approx(target[0, ELBOW], abs=2e-3)
    assert truth == pytest.approx(target[0, ELBOW] - 0.05, abs=2e-3)


def test_link_mass_is_weighed_by_the_feet() -> None:
    share = 12.0 / build_model().body("torso_link").mass[0] - 1
    robots, (qpos, qvel) = StandInRobots(1, [effect("link_mass", "torso_link", share)]), standing()
    robots.reset(qpos, qvel, qpos[:, 7:])
    weights = []
    for _ in range(20):
        robots.step(ONE, ServoCommand(qpos[:, 7:]))
        weights.append(robots.read().foot_force[0, :, 2].sum())
    declared = build_model()
    more = 12.0 - declared.body("torso_link").mass[0]
    assert np.mean(weights[5:]) == pytest.approx((declared.body_subtreemass[1] + more) * 9.81, rel=0.02)


def moved(robots: StandInRobots, ticks: list[list[int]], only: int) -> list[np.ndarray]:
    """Readings of robot `only` after each of its ticks; all stagger under targets that come and go."""
    count = 1 + max(max(ids) for ids in ticks)
    (qpos, qvel), rng = (np.repeat(a, count, axis=0) for a in standing()), np.random.default_rng(1)
    qvel[:, 6:] = rng.normal(0, 0.5, (1, 23))
    robots.reset(qpos, qvel, qpos[:, 7:])
    wave, done, rows = rng.normal(0, 0.15, (20, 23)), np.zeros(count, dtype=int), []
    for ids in ticks:
        robots.step(np.array(ids), ServoCommand(qpos[ids, 7:] + wave[done[ids]]))
        done[ids] += 1
        if only in ids:
            now = robots.read()
            rows.append(np.concatenate([getattr(now, name)[only].ravel() for name in vars(now)]))
    return rows


@pytest.mark.parametrize("name", [name for name, kind in KINDS.items() if fits(kind, "g1")])
def test_every_kind_acts_on_a_robot_that_steps_and_on_no_other(name: str) -> None:
    """Robot 0 rests while robot 1 goes on: it then moves as one that never rested, and not as the declared one."""
    kind = KINDS[name]
    where = next(w for w in ("left_knee_joint", "left_knee_link", "pelvis", "") if w in places(kind, declared_g1()))
    effects = [effect(name, where, largest(kind, spot(where)))]
    paused = moved(StandInRobots(2, effects), [[0, 1], [0, 1], [1], [1], [0], [0, 1], [0, 1], [0, 1]], 0)
    alone = moved(StandInRobots(1, effects), [[0]] * 6, 0)
    assert np.array_equal(paused, alone)
    assert np.abs(np.array(alone) - moved(StandInRobots(1, []), [[0]] * 6, 0)).max() > 1e-4


def test_a_feed_forward_torque_adds_to_the_servos_and_is_reported() -> None:
    robots = in_the_air([])
    target, torque = robots.read().joint_pos.copy(), np.zeros((1, 23))
    torque[0, KNEE] = 5.0
    robots.step(ONE, ServoCommand(target, torque), 1)
    assert robots.read().joint_vel[0, KNEE] == pytest.approx(5.0 * inverse_mass(KNEE) * 0.001, rel=1e-3)
    assert robots.read().joint_torque[0, KNEE] == pytest.approx(5.0)


def test_a_weak_motor_weakens_the_feed_forward_torque_too_and_does_not_know() -> None:
    robots = in_the_air([effect("motor_strength", "left_knee_joint", 0.4)])
    target, torque = robots.read().joint_pos.copy(), np.zeros((1, 23))
    torque[0, KNEE] = 5.0
    robots.step(ONE, ServoCommand(target, torque), 1)
    assert robots.read().joint_vel[0, KNEE] == pytest.approx(3.0 * inverse_mass(KNEE) * 0.001, rel=1e-3)
    assert robots.read().joint_torque[0, KNEE] == pytest.approx(5.0)


def test_target_and_feed_forward_torque_arrive_together() -> None:
    """A torque that cancels what the new target asks for: nothing moves, before the delay is over or after."""
    robots = in_the_air([effect("command_delay", "left_knee_joint", 0.015)])
    target, torque = robots.read().joint_pos.copy(), np.zeros((1, 23))
    target[0, KNEE] += 0.1
    torque[0, KNEE] = -0.1 * robots.kp[KNEE]
    robots.step(ONE, ServoCommand(target, torque))
    assert abs(robots.read().joint_vel[0, KNEE]) < 1e-6
    robots.step(ONE, ServoCommand(target))
    assert abs(robots.read().joint_vel[0, KNEE]) > 0.1


def test_a_lost_command_is_lost_with_its_torque() -> None:
    law, world = DroppedCommands(1.0), World(("a", "b"), 3, 0.001, np.random.default_rng(0))
    law.start(world, np.zeros((3, 2)))
    arrived = law.tick(world, ServoCommand(np.ones((3, 2)), np.ones((3, 2))))
    assert not arrived.target.any() and not arrived.torque.any()


def test_which_commands_are_lost_does_not_depend_on_who_runs_beside() -> None:
    effects = [effect("dropped_commands", "", 0.4)]
    beside = moved(StandInRobots(3, effects), [[0, 1, 2]] * 8, 1)
    assert np.array_equal(beside, moved(StandInRobots(1, effects), [[0]] * 8, 0))


def test_gains_of_a_command_hold_robot_by_robot_and_a_bad_drive_scales_them() -> None:
    """The first robot gets the usual gain, the second three times it; the drive has half of what it is told."""
    robots = StandInRobots(2, [effect("motor_strength", "left_knee_joint", 0.5)])
    qpos, qvel = (np.repeat(a, 2, axis=0) for a in standing())
    qpos[:, 2] += 5.0
    robots.reset(qpos, qvel, qpos[:, 7:])
    target, kp = qpos[:, 7:].copy(), np.tile(robots.kp, (2, 1))
    target[:, KNEE] += 0.05
    kp[1] *= 3
    robots.step(np.arange(2), ServoCommand(target, kp=kp, kd=robots.kd), 1)
    expected = 0.5 * kp[:, KNEE] * 0.05 * inverse_mass(KNEE) * 0.001
    assert robots.read().joint_vel[:, KNEE] == pytest.approx(expected, rel=1e-3)
    assert robots.read().joint_torque[:, KNEE] == pytest.approx(kp[:, KNEE] * 0.05)


def test_without_dry_friction_the_declared_solver_is_enough() -> None:
    declared = build_model().opt.iterations
    assert StandInRobots(1, []).model.opt.iterations == declared
    assert StandInRobots(1, [effect("ripple", "left_knee_joint", 1.0)]).model.opt.iterations == declared
    assert StandInRobots(1, [effect("coulomb_friction", "left_knee_joint", 1.0)]).model.opt.iterations > declared


def test_robots_side_by_side_are_the_same_robots() -> None:
    """Three robots in two parts move as three in one, also when one of them is left out of a step."""
    qpos, qvel = (np.repeat(a, 3, axis=0) for a in standing())
    qvel[:, 6:] = np.random.default_rng(0).normal(0, 1.0, (3, 23))
    ends = []
    for robots in (StandInRobots(3, []), SideBySide(lambda count: StandInRobots(count, []), 3, 2)):
        robots.reset(qpos, qvel, qpos[:, 7:])
        robots.step(np.arange(3), ServoCommand(qpos[:, 7:]))
        robots.step(np.array([0, 2]), ServoCommand(qpos[[0, 2], 7:] + 0.1))
        ends.append(robots.read())
    assert np.allclose(ends[0].joint_pos, ends[1].joint_pos, atol=1e-12)
