"""Drives of the declared model that are made to take what was logged."""

import mujoco

from bumblebee.diagnosis.simulation.actuators import take_torque


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
