"""Actuators whose commands or states no column holds are refused by name; those on joints are not."""

import mujoco
import numpy as np
import pytest

from bumblebee.diagnosis.dataset.session import make_session
from bumblebee.errors import BadInput
from bumblebee.measured.rollout import Rollout

ARM = """<mujoco><worldbody><body name="link"><joint name="hinge" axis="0 1 0"/><geom size=".1" pos="0 0 -.3" mass="1"/>
<site name="tip" pos="0 0 -.3"/></body></worldbody>
<tendon><fixed name="cord"><joint joint="hinge" coef="1"/></fixed></tendon>
<actuator><position name="servo" joint="hinge" kp="20" kv="1"/>{}</actuator></mujoco>"""


def rollout() -> Rollout:
    time = np.arange(100) * 0.01
    angle = 0.2 * np.sin(3 * time)[:, None]
    return Rollout("run", ("hinge",), 100.0, time, angle, 0.6 * np.cos(3 * time)[:, None], joint_target=angle)


@pytest.mark.parametrize(
    ("actuator", "named"),
    [
        ('<position name="winch" tendon="cord" kp="5"/>', "'winch'.*tendon"),
        ('<motor name="jet" site="tip" gear="0 0 1 0 0 0"/>', "'jet'.*site"),
        ('<intvelocity name="creeper" joint="hinge" kp="20" actrange="-1 1"/>', "'creeper'.*integrates"),
        ('<pid name="summer" joint="hinge" kp="4" ki="60" input="pos"/>', "'summer'.*sums up"),
        ('<dcmotor name="coil" joint="hinge" motorconst=".5" resistance="1" inductance=".02"/>', "'coil'.*current"),
    ],
)
def test_an_actuator_that_the_log_says_nothing_of_is_named(actuator: str, named: str) -> None:
    with pytest.raises(BadInput, match=named):
        make_session(mujoco.MjSpec.from_string(ARM.format(actuator)), [rollout()], "arm.xml", "logs")


def test_a_servo_stays_one_whose_commands_and_forces_have_ranges_without_zero() -> None:
    """It was asked for its stiffness at a command of zero, which its range turned into one at its force limit."""
    ranged = ARM.format("").replace('kp="20"', 'kp="2000" ctrlrange="-2.7 -.9" forcerange="-35 35"')
    session = make_session(mujoco.MjSpec.from_string(ranged), [rollout()], "arm.xml", "logs")
    assert not session.plant.torque_input and session.plant.scalable.all()


@pytest.mark.parametrize("actuator", ["", '<general name="dead" tendon="cord" gainprm="0"/>'])
def test_drives_on_joints_and_idle_ones_pass(actuator: str) -> None:
    session = make_session(mujoco.MjSpec.from_string(ARM.format(actuator)), [rollout()], "arm.xml", "logs")
    assert session.plant.joints == ("hinge",)
