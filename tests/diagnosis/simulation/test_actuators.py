"""Position and velocity actuators on one joint are one servo."""

import mujoco
import numpy as np
import pytest

from bumblebee.diagnosis.simulation.actuators import fold_dampers, take_torque
from bumblebee.sim.servo import servos_of

_ARM = """<mujoco><worldbody><body><joint name="j" axis="0 1 0"/><geom size=".1" pos=".2 0 0"/></body></worldbody>
<actuator>{}</actuator></mujoco>"""
_POSITION = '<position joint="j" kp="40" gear="2" forcerange="-30 30"/>'
_VELOCITY = '<velocity joint="j" kv="1.5" gear="4"/>'


@pytest.mark.parametrize("order", [(_POSITION, _VELOCITY), (_VELOCITY, _POSITION)])
def test_a_damper_beside_a_servo_becomes_its_gain(order: tuple[str, str]) -> None:
    """Joint damping 1.5 * 4^2 = 24 N m s/rad; the motion is that of the two actuators."""
    spec = mujoco.MjSpec.from_string(_ARM.format("".join(order)))
    folded, names = fold_dampers(spec)
    model, declared = folded.compile(), spec.compile()
    assert names == ["j"] and model.nu == 2
    servo = servos_of(model, [0])
    assert servo.actuator[0] == order.index(_POSITION)
    assert servo.bias[0] == pytest.approx([0, -160, -24])
    ends = []
    for m in (model, declared):
        data = mujoco.MjData(m)
        data.ctrl[servo.actuator[0]] = 0.6
        mujoco.mj_step(m, data, 40)
        ends.append((data.qpos[0], data.qvel[0]))
    assert ends[0][0] != 0 and np.allclose(ends[0], ends[1], rtol=1e-9)


def test_a_lone_servo_and_a_lone_damper_stay_as_they_are() -> None:
    for alone in (_POSITION, _VELOCITY):
        spec = mujoco.MjSpec.from_string(_ARM.format(alone))
        assert fold_dampers(spec) == (spec, [])


def test_a_drive_that_integrates_takes_the_logged_torque_without_the_range_of_its_activation() -> None:
    spec = mujoco.MjSpec.from_string(
        '<mujoco><worldbody><body><joint name="j"/><geom size=".1" mass="1"/></body></worldbody>'
        '<actuator><intvelocity joint="j" kp="5" actrange="-1 1"/></actuator></mujoco>'
    )
    take_torque(spec.actuators[0])
    model = spec.compile()
    data = mujoco.MjData(model)
    data.ctrl[0] = 2.5
    mujoco.mj_forward(model, data)
    assert model.na == 0
    assert data.qfrc_actuator[0] == 2.5
