"""The base's velocity from a foot that stands: without motion capture it tells base-frame from world-frame velocity.

A point that stands on the ground has velocity zero, so the base moves by minus what base rotation and joints give the
point. The lowest geom is taken for the one that stands; medians over the rollout bear with the times when it slides.
"""

import mujoco
import numpy as np

from bumblebee.measured.checks.view import View
from bumblebee.quaternions import conjugate, rotate_by_cross

ROWS = 400  # as many rows say enough


def check_stance(view: View, quat: np.ndarray) -> None:
    """base_lin_vel against the standing foot's, as base-frame and as world-frame velocity."""
    rollout, limits = view.rollout, view.limits
    if rollout.base_ang_vel is None or min(view.joint_ids()) < 0 or not view.floating:
        return
    rows = np.unique(np.linspace(0, rollout.frames - 1, ROWS).astype(int))
    expected = stance_velocity(view, quat, rows)
    if expected is None:
        return
    given = view.values("base_lin_vel")[rows]
    as_world = rotate_by_cross(conjugate(quat[rows]), given)
    apart = np.maximum(2 * limits.drift_floor, limits.frame_apart * np.linalg.norm(given, axis=1))
    telling = np.linalg.norm(as_world - given, axis=1) > apart  # else both readings are one
    if telling.sum() < 10:
        return
    errors = [float(np.median(np.linalg.norm((reading - expected)[telling], axis=1))) for reading in (given, as_world)]
    if errors[1] < 0.5 * errors[0]:
        came = f"mismatch {errors[0]:.3g} m/s with the standing foot, {errors[1]:.3g} as world-frame velocity"
        view.add("base_lin_vel", None, "velocity-frame", "the base frame", f"the world frame: {came}", fatal=True)


def stance_velocity(view: View, quat: np.ndarray, rows: np.ndarray) -> np.ndarray | None:
    """(rows, 3) the base's velocity in its own frame if the lowest geom stands still; None for a model without one."""
    model, rollout = view.model, view.rollout
    data = mujoco.MjData(model)
    free = int(np.flatnonzero(model.jnt_type == mujoco.mjtJoint.mjJNT_FREE)[0])
    place, speed = int(model.jnt_qposadr[free]), int(model.jnt_dofadr[free])
    joints = view.joint_ids()
    geoms = np.flatnonzero((model.geom_bodyid > 0) & ((model.geom_contype > 0) | (model.geom_conaffinity > 0)))
    if len(geoms) == 0:
        return None
    size = np.where(model.geom_type[geoms] == mujoco.mjtGeom.mjGEOM_SPHERE, model.geom_size[geoms, 0], 0.0)
    out, motion = np.zeros((len(rows), 3)), np.zeros(6)
    for index, row in enumerate(rows):
        data.qpos[place + 3 : place + 7] = quat[row]
        data.qpos[model.jnt_qposadr[joints]] = rollout.joint_pos[row]
        data.qvel[speed + 3 : speed + 6] = view.values("base_ang_vel")[row]
        data.qvel[model.jnt_dofadr[joints]] = rollout.joint_vel[row]
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_comVel(model, data)
        lowest = int(geoms[np.argmin(data.geom_xpos[geoms, 2] - size)])
        mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_GEOM, lowest, motion, 0)
        out[index] = -motion[3:]
    return rotate_by_cross(conjugate(quat[rows]), out)
