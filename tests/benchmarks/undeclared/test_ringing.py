"""Shafts in the benchmark: with the encoder on the joint, none is drawn that the servo shakes by itself."""

import mujoco
import numpy as np
import pytest

from benchmarks.undeclared.robots import declared
from bumblebee.robot.servo_command import ServoCommand
from bumblebee.stand_in.undeclared.gears import Elastic
from bumblebee.stand_in.undeclared.kinds import KINDS, Place
from bumblebee.stand_in.undeclared.ringing import softest
from bumblebee.stand_in.undeclared.simulation import TrueRobots

ARM = declared("arm")
POSE = np.array([[0.0, 0.5, 0.6, 0.0, 0.3]])


def speeds(joint: str, compliance: float) -> tuple[float, float]:
    """RMS speed [rad/s] of a joint in the first and in the last 0.2 s of 1 s under a target that is held."""
    robots = TrueRobots(ARM, [Elastic(joint, 1 / compliance)], 1, np.random.default_rng(0))
    robots.reset(POSE, np.zeros_like(POSE), POSE + 0.02)
    path = []
    for _ in range(50):
        robots.step(ServoCommand(POSE + 0.02))
        path.append(robots.state()[1][0, ARM.joints.index(joint)])
    return float(np.sqrt(np.mean(np.square(path[:10])))), float(np.sqrt(np.mean(np.square(path[-10:]))))


@pytest.mark.parametrize("joint", ["elbow", "wrist"])
def test_the_softest_shaft_settles_and_a_softer_one_swings_up(joint: str) -> None:
    first, last = speeds(joint, softest(ARM, joint))
    assert last < 0.3 * first
    first, last = speeds(joint, 4 * softest(ARM, joint))
    assert last > first


def test_only_the_encoder_on_the_joint_bounds_the_compliance_further() -> None:
    most = KINDS["series_elasticity"].most
    motor, joint = (most(Place(ARM, "wrist", {"sign": sign})) for sign in (1, -1))
    assert motor == pytest.approx(1 / 25.0)
    assert joint == pytest.approx(softest(ARM, "wrist"))
    assert joint < 0.2 * motor


def test_a_shaft_swings_as_two_masses_do() -> None:
    """Without gravity's or other joints' help: the period of link against rotor, servo off, to 1 %."""
    spec = ARM.spec.copy()
    spec.option.gravity = [0.0, 0.0, 0.0]
    free = type(ARM)(**{**vars(ARM), "spec": spec, "kp": 0 * ARM.kp, "kd": 0 * ARM.kd})
    robots = TrueRobots(free, [Elastic("wrist", 600.0)], 1, np.random.default_rng(0))
    robots.reset(POSE, np.zeros_like(POSE), POSE)
    law = robots.laws[0]
    law._damping, law._angle, law._given = 0.0, law._angle + 0.01, law._given + 6.0
    twist = []
    for _ in range(200):
        robots.step(ServoCommand(POSE), cycles=1)
        twist.append(law._angle[0] - robots.state()[0][0, 4])
    signs = np.flatnonzero(np.diff(np.sign(twist)) > 0)
    measured = 2 * np.pi * (len(signs) - 1) / ((signs[-1] - signs[0]) * 1e-3)
    model = robots.model
    data = mujoco.MjData(model)
    data.qpos[:] = POSE[0]
    mujoco.mj_forward(model, data)
    full = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, full)
    expected = np.sqrt(600.0 * (1 / (0.9 * ARM.armature[4]) + np.linalg.inv(full)[4, 4]))
    assert measured == pytest.approx(expected, rel=0.01)
    assert np.ptp(twist[-20:]) == pytest.approx(np.ptp(twist[:20]), rel=0.1)
