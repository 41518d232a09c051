"""The torque that a limb which touches nothing asks of its joint, by inverse dynamics of the measured motion.

On a floating base the contacts are unknown; of a joint whose limb has none they do not matter: the row of the equations
of motion is that of the bodies beyond the joint, moved by the base and by the joints on the way to them as measured.
How the base's place accelerates is left out: few logs have its velocity, and differences of noisy ones tell less.
"""

import mujoco
import numpy as np

from bumblebee.measured.checks.view import View
from bumblebee.quaternions import normalised

_ALONE = int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)


def torque_asked(view: View, joint: int, starts: np.ndarray, window: int) -> np.ndarray | None:
    """(N,) of the joint over stretches of `window` rows from `starts` [N m, N].

    None where the limb reaches into the lower half between the robot's lowest body and its base, as what it stands or
    kneels on does, where the base's direction or rate was not logged, and for a model of more than the base and the
    logged joints.
    """
    model, rollout, ids = view.model, view.rollout, view.joint_ids()
    if rollout.base_quat is None or rollout.base_ang_vel is None or min(ids, default=-1) < 0:
        return None
    if model.nq != 7 + len(ids) or model.jnt_type[0] != mujoco.mjtJoint.mjJNT_FREE:
        return None
    at, dof = model.jnt_qposadr[ids], model.jnt_dofadr[ids]
    quat = normalised(rollout.base_quat)
    data, out, flags = mujoco.MjData(model), np.empty(len(starts)), int(model.opt.disableflags)
    speeds = np.zeros((rollout.frames, model.nv))
    speeds[:, 3:6], speeds[:, dof] = rollout.base_ang_vel, rollout.joint_vel
    limb = _beyond(model, int(model.jnt_bodyid[ids[joint]]))
    try:
        model.opt.disableflags = flags | _ALONE
        for k, start in enumerate(starts):
            row = start + window // 2
            data.qpos[3:7], data.qpos[at], data.qvel[:] = quat[row], rollout.joint_pos[row], speeds[row]
            seconds = rollout.time[start + window] - rollout.time[start]
            data.qacc[:] = (speeds[start + window] - speeds[start]) / seconds
            mujoco.mj_inverse(model, data)
            height = data.xpos[1:, 2]
            if (height[limb[1:]] < (height.min() + data.xpos[model.jnt_bodyid[0], 2]) / 2).any():
                return None
            out[k] = data.qfrc_inverse[dof[joint]]
    finally:
        model.opt.disableflags = flags
    return out


def _beyond(model: mujoco.MjModel, body: int) -> np.ndarray:
    """(bodies,) whether each hangs on `body`, which counts itself."""
    found = np.zeros(model.nbody, dtype=bool)
    found[body] = True
    for other in range(body + 1, model.nbody):
        found[other] |= found[model.body_parentid[other]]
    return found
