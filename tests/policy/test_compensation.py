"""Effects that the diagnosis found and a drive can undo are undone: a hanging robot moves as the declared one does."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest

from bumblebee.compensation.numbers import Compensation, as_table
from bumblebee.compensation.plan import compensate
from bumblebee.compensation.runtime import Compensator, put_right
from bumblebee.errors import BadInput
from bumblebee.motion.clip import Clip
from bumblebee.motion.kinematics import make_clip
from bumblebee.policy.exported import ExportedPolicy
from bumblebee.policy.robots import NominalRobots
from bumblebee.policy.runner import PolicyRunner, reference_library
from bumblebee.robot.facts import joint_names, joints, stand_pose
from bumblebee.robot.model import gains
from bumblebee.robot.sensors import Sensors
from bumblebee.robot.servo_command import ServoCommand
from bumblebee.sim.effects import CATALOGUE, Effect, add_to_spec
from bumblebee.sim.sensors import load_spec
from bumblebee.tracking.sampling.library import MotionLibrary
from tests.policy.imperfect import HEIGHT, Imperfect

KNEE, SHOULDER, HAND = "left_knee_joint", "left_shoulder_pitch_joint", "left_wrist_yaw_link"
ONE = np.array([0])
FRAMES = 60


def column(joint: str) -> int:
    return joint_names().index(joint)


def swing(rate: float = 1.2) -> Clip:
    """Knee and shoulder swing so many times a second, slowly at first."""
    time = np.arange(FRAMES) / 50
    wave = 0.4 * np.sin(2 * np.pi * rate * time) * np.minimum(time / 0.3, 1.0)
    joint_pos = np.tile(stand_pose(), (FRAMES, 1))
    joint_pos[:, column(KNEE)] += wave + 0.3
    joint_pos[:, column(SHOULDER)] += wave - 0.6
    root = np.tile([0.0, 0.0, HEIGHT], (FRAMES, 1))
    return make_clip("swing", 50.0, root, np.tile([1.0, 0, 0, 0], (FRAMES, 1)), joint_pos)


def effect(kind: str, where: str, *values: float) -> Effect:
    names = CATALOGUE[kind].names[: len(values)]
    return Effect(kind, (where,) if where else (), dict(zip(names, values, strict=True)))


@pytest.fixture
def policy(policy_folder: Callable[..., Path]) -> ExportedPolicy:
    return ExportedPolicy.load(policy_folder(gain=0.0))


def run(
    policy: ExportedPolicy, effects: Sequence[Effect], compensation: Compensation | None, rate: float = 1.2
) -> np.ndarray:
    """True joint angles (T, J) of one robot with these effects."""
    clip, robots = swing(rate), Imperfect(effects)
    runner = PolicyRunner(policy, reference_library(policy, [clip]), [clip.name], compensation)
    qpos = np.concatenate([clip.root_pos[:1], clip.root_quat[:1], clip.joint_pos[:1]], axis=1).astype(np.float64)
    robots.reset(qpos, np.zeros((1, 29)), runner.hold())
    angles = []
    for tick in range(FRAMES):
        _, command = runner.step(ONE, tick, robots.read())
        robots.step(ONE, command)
        angles.append(robots.angles()[0].copy())
    return np.array(angles)


CASES = {
    "encoder_offset": ([effect("encoder_offset", KNEE, 0.1)], 0.02),
    "motor_strength": ([effect("motor_strength", KNEE, 0.6)], 0.02),
    "kp": ([effect("kp", SHOULDER, 0.6)], 0.02),
    "kd": ([effect("kd", KNEE, 2.0)], 0.02),
    "strength, kp and offset": (
        [effect("motor_strength", KNEE, 0.8), effect("kp", KNEE, 0.8), effect("encoder_offset", KNEE, -0.05)],
        0.02,
    ),
    "viscous_friction, within kd": ([effect("viscous_friction", KNEE, 3.0)], 0.02),
    "viscous_friction, beyond kd": ([effect("viscous_friction", KNEE, 8.0)], 0.25),
    "quadratic_friction": ([effect("quadratic_friction", KNEE, 1.5)], 0.7),
    "coulomb_friction": ([effect("coulomb_friction", KNEE, 8.0)], 0.3),
    "stribeck_friction": (
        [effect("stribeck_friction", KNEE, 6.0, 0.3), effect("coulomb_friction", KNEE, 2.0)],
        0.7,
    ),
    "load_dependent_friction": ([effect("load_dependent_friction", SHOULDER, 0.6)], 0.4),
    "asymmetric_friction": ([effect("asymmetric_friction", KNEE, 6.0)], 0.02),
    "cogging": ([effect("cogging", KNEE, 3.0, 1.0, 12.0)], 0.2),
    "joint_spring": ([effect("joint_spring", KNEE, 15.0, 2.0)], 0.1),
    "hysteresis, Dahl": ([effect("hysteresis", KNEE, 5.0, 0.05, 1.0)], 0.5),
    "hysteresis, a spring that yields": ([effect("hysteresis", KNEE, 5.0, 0.05)], 0.5),
    "armature": ([effect("armature", KNEE, 0.15)], 0.65),
    "link_mass": ([effect("link_mass", HAND, 2.0)], 0.2),
    "link_com": ([effect("link_com", HAND, 0.3, 0.0, 0.0)], 0.3),
    "command_delay, one joint": ([effect("command_delay", KNEE, 0.03)], 0.1),
    "command_delay, the whole robot": ([effect("command_delay", "", 0.03)], 0.1),
    "encoder_delay": ([effect("encoder_delay", SHOULDER, 0.01)], 0.65),
    "discovered, of the angle": ([Effect("discovered", (KNEE,), {"sin(4*q)": 4.0})], 0.1),
    "discovered, of the velocity": ([Effect("discovered", (KNEE,), {"v*abs(v)": -1.5})], 0.7),
    "discovered, friction": ([Effect("discovered", (KNEE,), {"friction(1+q^2)": 4.0})], 0.4),
    "discovered, in the drive": ([Effect("discovered", (KNEE,), {"sin(9*u)": 4.0})], 0.2),
    "discovered, of another joint": ([Effect("discovered", (KNEE,), {f"q[{SHOULDER}]": 12.0})], 0.1),
}


DECLARED: dict[float, np.ndarray] = {}  # the declared robot's motion, by the clip's rate


@pytest.mark.parametrize("name", CASES)
def test_a_robot_with_the_effect_moves_as_the_declared_one_under_the_compensation(
    name: str, policy: ExportedPolicy
) -> None:
    """Compare the distance to the declared robot's motion with the compensation and without."""
    effects, left = CASES[name]
    rate = 0.2 if name.startswith("link") else 1.2  # what carries a load's weight does not speed it up
    if rate not in DECLARED:
        DECLARED[rate] = run(policy, [], None, rate)
    declared = DECLARED[rate]
    raw, undone = (run(policy, effects, c, rate) - declared for c in (None, compensate(effects)))
    assert np.sqrt((raw**2).mean()) > 0.002, "the effect must matter"
    assert np.sqrt((undone**2).mean()) < left * np.sqrt((raw**2).mean())


def test_every_kind_of_the_catalogue_is_undone_or_has_a_reason() -> None:
    tried = {e.effect for effects, _ in CASES.values() for e in effects}
    not_undone = {name for name, kind in CATALOGUE.items() if kind.not_undone}
    assert tried | {"imu_offset", "torque_lag"} | not_undone == set(CATALOGUE)
    assert not tried & not_undone


def test_a_turned_imu_and_encoders_that_are_off_and_late_are_put_right_before_the_policy_sees_them() -> None:
    effects = [
        effect("imu_offset", "pelvis", 0.05, -0.1),
        effect("encoder_offset", KNEE, 0.1),
        effect("encoder_delay", SHOULDER, 0.01),
    ]
    clip, robots = swing(), Imperfect(effects)
    qpos = np.concatenate([clip.root_pos[:1], clip.root_quat[:1], clip.joint_pos[:1]], axis=1).astype(np.float64)
    robots.reset(qpos, np.zeros((1, 29)), qpos[:, 7:])
    target = qpos[:, 7:].copy()
    target[:, [column(SHOULDER), column(KNEE)]] += 0.3
    offset = np.where(np.arange(23) == column(KNEE), 0.1, 0.0)
    for _ in range(3):
        robots.step(ONE, ServoCommand(target + offset))
    raw, seen = robots.read(), put_right(compensate(effects), robots.read())
    assert np.abs(raw.joint_pos - robots.angles()).max() > 0.02
    assert np.allclose(seen.joint_pos, robots.angles(), atol=0.01)
    true = NominalRobots.read(robots).base_quat
    assert np.abs(raw.base_quat - true).max() > 0.02
    assert np.allclose(seen.base_quat, true, atol=1e-9)


def test_feed_forward_torque_is_sent_earlier_by_delay_and_lag_and_is_larger_on_a_weak_motor() -> None:
    effects = [effect("command_delay", KNEE, 0.01), effect("torque_lag", KNEE, 0.02)]
    made = compensate([*effects, effect("motor_strength", SHOULDER, 0.5), effect("joint_spring", SHOULDER, 0.0, 1.0)])
    assert made.torque_lead[column(KNEE)] == pytest.approx(0.03)
    assert made.lead_time[column(KNEE)] == pytest.approx(0.01)
    clip = swing()
    undo = Compensator(made, MotionLibrary([clip]), np.array([0]), 0.02)
    told = undo.command(ONE, 0, at_rest(clip), clip.joint_pos[:1].astype(np.float64))
    assert told.torque is not None and told.torque[0, column(SHOULDER)] == pytest.approx(-2.0)
    assert told.kp is not None
    assert told.kp[column(SHOULDER)] == pytest.approx(2 * gains(joints()[column(SHOULDER)])[0])


def test_torque_never_exceeds_its_share_of_the_limit_whatever_is_read() -> None:
    made = compensate([Effect("discovered", (KNEE,), {"exp(q)": 40.0, "1/v": 1.0})])
    clip = swing()
    undo = Compensator(made, MotionLibrary([clip]), np.array([0]), 0.02)
    for place in (9.0, -9.0, np.nan):
        read = at_rest(clip)
        read.joint_pos[:] = place
        torque = undo.command(ONE, 0, read, np.zeros((1, 23))).torque
        assert torque is not None and np.isfinite(torque).all()
        assert (np.abs(torque) <= 0.5 * np.array([joint.effort_limit for joint in joints()])).all()


def test_targets_that_are_sent_ahead_stay_within_the_joints_range() -> None:
    low, high = joints()[column(KNEE)].range
    made, clip = compensate([effect("command_delay", KNEE, 0.06)]), swing(2.0)
    undo = Compensator(made, MotionLibrary([clip]), np.array([0]), 0.02)
    sent = [undo.command(ONE, t, at_rest(clip), clip.joint_pos[t : t + 1] * 0 + high - 1e-3) for t in range(40)]
    assert max(told.target[0, column(KNEE)] for told in sent) <= high
    assert min(told.target[0, column(KNEE)] for told in sent) >= low


def test_the_weight_of_a_load_that_a_motion_asks_too_much_torque_for_is_refused_at_the_start() -> None:
    made = compensate([effect("link_mass", HAND, 12.0)])
    with pytest.raises(BadInput, match=r"swing: left_.*at most 0.5 of the effort limit.*left_wrist_yaw_link"):
        Compensator(made, MotionLibrary([swing()]), np.array([0]), 0.02)


BEYOND = {
    "offset": (effect("encoder_offset", KNEE, 0.31), "at most 0.3 rad, came 0.31 rad on left_knee_joint"),
    "imu": (effect("imu_offset", "pelvis", 0.15, 0.15), "at most 0.2 rad, came 0.212 rad"),
    "weak": (effect("motor_strength", KNEE, 0.3), "0.4 to 2.5 times the declared one, came 3.33"),
    "strong": (effect("kp", KNEE, 3.0), "0.4 to 2.5 times the declared one, came 0.333"),
    "no damping": (effect("kd", KNEE, 0.0), "a gain of nothing"),
    "delay": (effect("command_delay", "", 0.07), "at most 60 ms to look ahead, came 70 ms"),
    "friction": (effect("coulomb_friction", KNEE, 120.0), "at most 0.5 of the effort limit, came 0.69"),
    "another robot": (effect("coulomb_friction", "joint_7", 1.0), "a joint of the G1, came 'joint_7', of another"),
    "another body": (effect("link_mass", "gripper", 1.0), "a body of the G1, came 'gripper', of another robot"),
    "other joint": (Effect("discovered", (KNEE,), {"q[elbow]": 1.0}), "came 'elbow', of another robot"),
    "memory": (Effect("discovered", (KNEE,), {"rested(0.1, 0.2)": 1.0}), "it remembers"),
    "torque": (Effect("discovered", (KNEE,), {"tau^2": 1.0}), "the drive's torque at the same instant"),
    "time": (Effect("discovered", (KNEE,), {"sin(t)": 1.0}), "how long the robot has run"),
    "play": (effect("backlash", KNEE, 0.01), "within its play the motor does not touch the link"),
    "floor": (effect("ground_friction", "floor", 0.4), "it is in the floor"),
}


@pytest.mark.parametrize("name", BEYOND)
def test_what_cannot_be_undone_is_one_line_and_is_left_out_only_if_told_so(name: str) -> None:
    wrong, words = BEYOND[name]
    fine = effect("coulomb_friction", KNEE, 1.0)
    with pytest.raises(BadInput) as caught:
        compensate([fine, wrong], where="effects.yaml")
    line = str(caught.value)
    assert words in line and "--leave-out" in line and line.startswith(f"effects.yaml: effects[1]: {wrong.effect}")
    left = compensate([fine, wrong], leave_out=True)
    assert [bool(step.done) for step in left.plan] == [True, False] and left.plan[1].why_not
    without = {name: value for name, value in as_table(left).items() if name not in ("plan", "effects_sha256")}
    alone = as_table(compensate([fine]))
    assert without == {name: alone[name] for name in without}


def test_effects_count_by_what_they_exceed_the_policys_own_model() -> None:
    """Against a model that has the friction already there is nothing left to undo."""
    spec = load_spec()
    add_to_spec(spec, [effect("coulomb_friction", KNEE, 1.5), effect("viscous_friction", KNEE, 1.0)])
    known = compensate([effect("coulomb_friction", KNEE, 2.0), effect("viscous_friction", KNEE, 1.0)], spec.compile())
    assert known.dry[column(KNEE)] == pytest.approx(0.5)
    assert known.kd[column(KNEE)] == pytest.approx(gains(joints()[column(KNEE)])[1])


def test_drives_offsets_and_delays_count_by_what_they_exceed_the_policys_own_model() -> None:
    """A policy that was refined with a servo of .6 of its kp wants such a servo, and is sent the declared gain."""
    spec, k = load_spec(), column(KNEE)
    kinds = {"kp": 0.6, "kd": 0.7, "motor_strength": 0.8, "encoder_offset": 0.05, "command_delay": 0.02}
    effects = [effect(kind, KNEE, value) for kind, value in kinds.items()]
    add_to_spec(spec, effects)
    declared, known = compensate(effects[:0]), compensate(effects, spec.compile())
    for name in ("kp", "kd", "encoder_offset", "lead_time", "torque_lead"):
        assert getattr(known, name)[k] == pytest.approx(getattr(declared, name)[k], abs=1e-6), name


def at_rest(clip: Clip) -> Sensors:
    """Readings on the clip's first frame."""
    return Sensors(
        joint_pos=clip.joint_pos[:1].astype(np.float64),
        joint_vel=np.zeros((1, 23)),
        base_quat=clip.root_quat[:1].astype(np.float64),
        base_ang_vel=np.zeros((1, 3)),
        base_lin_vel=np.zeros((1, 3)),
        base_pos=clip.root_pos[:1].astype(np.float64),
        joint_torque=np.zeros((1, 23)),
        foot_force=np.zeros((1, 2, 3)),
    )
