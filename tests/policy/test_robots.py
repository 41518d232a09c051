"""Drive commands on the declared model: torque and gains are exact, and without them nothing changes."""

import mujoco
import numpy as np

from bumblebee.policy.robots import NominalRobots, SideBySide
from bumblebee.robot.facts import joint_names, joints
from bumblebee.robot.model import build_model, gains
from bumblebee.robot.servo_command import ServoCommand

KNEE = joint_names().index("left_knee_joint")
KP, KD = np.array([gains(joint) for joint in joints()]).T
ONE = np.array([0])


def standing(count: int = 1) -> tuple[np.ndarray, np.ndarray]:
    qvel = np.random.default_rng(0).normal(0, 0.3, (1, 29))
    return np.tile(build_model().key("stand").qpos, (count, 1)), np.tile(qvel, (count, 1))


def moved(*commands: ServoCommand) -> np.ndarray:
    """Joint angles (23,) after some control periods."""
    robots, (qpos, qvel) = NominalRobots(1, threads=1), standing()
    robots.reset(qpos, qvel, qpos[:, 7:])
    for command in commands:
        robots.step(ONE, command)
    return robots.read().joint_pos[0]


def target() -> np.ndarray:
    return standing()[0][:, 7:] + 0.05


def test_the_declared_gains_and_no_torque_change_nothing_bit_for_bit() -> None:
    plain = moved(*[ServoCommand(target())] * 3)
    assert np.array_equal(moved(*[ServoCommand(target(), np.zeros((1, 23)), KP, KD)] * 3), plain)


def test_gains_hold_for_one_command_only() -> None:
    soft = ServoCommand(target(), None, 0.5 * KP, 0.5 * KD)
    plain = ServoCommand(target())
    robots, (qpos, qvel) = NominalRobots(2, threads=1), standing(2)
    robots.reset(qpos, qvel, qpos[:, 7:])
    robots.step(np.array([0]), soft)
    robots.step(np.array([1]), plain)
    apart = robots.read().joint_pos
    assert np.abs(apart[0] - apart[1]).max() > 1e-3
    assert np.array_equal(apart[1], moved(plain))
    robots.step(np.arange(2), ServoCommand(np.repeat(target(), 2, axis=0)))
    assert np.array_equal(robots.read().joint_pos[1], moved(plain, plain))


def test_feed_forward_torque_is_the_joints_torque() -> None:
    """Against MuJoCo's own qfrc_applied, with soft gains too."""
    push = np.zeros((1, 23))
    push[0, KNEE] = 4.0
    for factor in (1.0, 0.5):
        model = build_model()
        model.actuator_gainprm[:, 0] *= factor
        model.actuator_biasprm[:, 1:3] *= factor
        data, (qpos, qvel) = mujoco.MjData(model), standing()
        data.qpos[:], data.qvel[:], data.ctrl[:] = qpos[0], qvel[0], target()[0]
        data.qfrc_applied[6 + KNEE] = 4.0
        mujoco.mj_step(model, data, 4)
        assert np.allclose(moved(ServoCommand(target(), push, factor * KP, factor * KD)), data.qpos[7:], atol=1e-9)
    assert np.abs(moved(ServoCommand(target(), push)) - moved(ServoCommand(target()))).max() > 1e-3


def test_torque_counts_within_the_drives_limit() -> None:
    """More than the limit is the limit: what the joint does no longer depends on it."""
    pushes = [np.where(np.arange(23) == KNEE, size, 0.0)[None] for size in (1e3, 2e3)]
    first, second = (moved(ServoCommand(target(), push)) for push in pushes)
    assert np.allclose(first, second, atol=1e-9)


def test_robots_side_by_side_get_their_own_torque_and_gains() -> None:
    count = 5
    qpos, qvel = standing(count)
    rng = np.random.default_rng(1)
    torque, factor = rng.normal(0, 2, (count, 23)), rng.uniform(0.5, 2, (count, 1))
    command = ServoCommand(qpos[:, 7:] + 0.05, torque, factor * KP, factor * KD)
    ends = []
    for robots in (NominalRobots(count, 1), SideBySide(lambda n: NominalRobots(n, 1), count, 2)):
        robots.reset(qpos, qvel, qpos[:, 7:])
        robots.step(np.array([0, 1, 3, 4]), command[np.array([0, 1, 3, 4])])
        ends.append(robots.read().joint_pos)
    assert np.array_equal(ends[0], ends[1])
