"""How soft a shaft may be before a servo that reads the joint behind it shakes the robot by itself.

Motor and encoder on two sides of a spring are a loop that swings up where the shaft is too soft for its damping: what
such a robot does says nothing of its shaft, and no maker would ship it.
"""

import mujoco
import numpy as np
from scipy.linalg import expm

from bumblebee.stand_in.undeclared.declared import Declared
from bumblebee.stand_in.undeclared.gears import LOSS, ROTOR
from bumblebee.stand_in.undeclared.simulation import STEP

_DIES = -1.0  # [1/s] growth of the slowest swing, at most
_MARGIN = 1.25  # of the stiffness, for poses in which the link weighs less
_GRID = np.geomspace(300.0, 1.0, 76)  # stiffnesses tried, in units of kp, the stiffest first


def growth(rotor: float, link: float, stiffness: float, kp: float, kd: float) -> float:
    """Rate [1/s] at which two masses swing up under a servo that holds its torque on the rotor for `STEP`.

    Args:
        rotor: inertia of the rotor [kg m^2].
        link: of the link, whose angle and speed the servo reads.
        stiffness: of the spring between them [N m/rad], damped as `gears.Elastic` is.
        kp: servo's gain [N m/rad].
        kd: [N m s/rad].
    """
    loss = LOSS * np.sqrt(stiffness * rotor)
    spring = np.array([-stiffness, -loss, stiffness, loss])
    flow = np.zeros((5, 5))
    flow[0, 1] = flow[2, 3] = 1.0
    flow[1, :4], flow[3, :4], flow[1, 4] = spring / rotor, -spring / link, 1 / rotor
    step = expm(flow * STEP)
    closed = step[:4, :4] - np.outer(step[:4, 4], [0.0, 0.0, kp, kd])
    return float(np.log(np.abs(np.linalg.eigvals(closed)).max()) / STEP)


def softest(robot: Declared, joint: str) -> float:
    """Largest compliance [rad/(N m)] of a shaft with the encoder on the joint whose swings die, others held or free."""
    model = robot.spec.compile()
    data = mujoco.MjData(model)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    full = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, full)
    dof, j = int(model.joint(joint).dofadr[0]), robot.joints.index(joint)
    kp, kd, rotor = float(robot.kp[j]), float(robot.kd[j]), ROTOR * float(robot.armature[j])
    links = full[dof, dof] - rotor, 1 / np.linalg.inv(full)[dof, dof] - rotor
    shaking = (x for x in _GRID if max(growth(rotor, link, x * kp, kp, kd) for link in links) > _DIES)
    return 1 / (_MARGIN * kp * float(next(shaking, 1.0 / _MARGIN)))
