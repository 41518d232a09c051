"""The G1 on its feet: refused where its servos do not hold it up, planned for where they do."""

import mujoco
import numpy as np
import pytest

from bumblebee.diagnosis.plan import PlanConfig, make_plan, set_stage
from bumblebee.errors import BadInput
from bumblebee.robot.model import build_spec

FEW = PlanConfig(runs=1, seconds=4.5, pool=5, speed={"": 4.0})


def stiff() -> mujoco.MjSpec:
    """The G1 with servos that hold it up without a balance controller."""
    spec = build_spec()
    for actuator in spec.actuators:
        gain, bias = actuator.gainprm.copy(), actuator.biasprm.copy()
        gain[0], bias[1], bias[2] = 16 * gain[0], 16 * bias[1], 8 * bias[2]
        actuator.gainprm, actuator.biasprm = gain, bias
    return spec


def test_the_declared_g1_falls_and_is_refused() -> None:
    with pytest.raises(BadInput, match="tilts"):
        set_stage(build_spec(), "g1", FEW, None, None)


@pytest.mark.slow
def test_a_g1_with_stiff_servos_stays_on_its_feet_under_its_plan() -> None:
    plan = make_plan(stiff(), "g1", FEW)
    model = stiff().compile()
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    steps = round(0.02 / model.opt.timestep)
    order = [model.actuator(a).trnid[0] for a in range(model.nu)]
    column = [plan.machine.joints.index(model.joint(j).name) for j in order]
    for target in np.concatenate((np.tile(plan.machine.home, (100, 1)), plan.motions[0].targets)):
        data.ctrl[:] = target[column]
        mujoco.mj_step(model, data, steps)
        assert data.xmat[1].reshape(3, 3)[2, 2] > np.cos(0.15)
    assert np.ptp(plan.motions[0].targets, axis=0).max() > 0.02
