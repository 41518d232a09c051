"""From a plan to joint angles: centre of mass from the ZMP, inverse kinematics, a correction by full dynamics.

1. Cart-table model: (g + z'') x - z x'' = (g + z'') p has one bounded solution x for a ZMP p, and over a clip
   that starts and ends at rest it is a tridiagonal system.
2. Waist, arms and the pelvis' orientation are given, so two feet (12), the centre of mass (2) and a height (1)
   determine the 12 leg joints and the pelvis' position: Newton's method, warm-started frame by frame.
3. The ZMP of the whole body by inverse dynamics differs from the plan's as limbs swing; its error goes through
   step 1 and is added to the centre of mass (the dynamic filter of Kajita et al., 2003).
"""

from functools import cache

import mujoco
import numpy as np
from scipy.linalg import solve_banded

from bumblebee.errors import BadInput
from bumblebee.motion.embedded.plan import ANKLE_X, FPS, PELVIS_HEIGHT, Plan, ease
from bumblebee.robot.facts import FEET, stand_pose
from bumblebee.robot.model import build_model

GRAVITY = 9.81
DT = 1.0 / FPS
FILTER_PASSES = 3
NEWTON_STEPS = 30
TOLERANCE = 1e-7
END_EASE = 0.4  # s
LEG_DOFS = np.arange(6, 18)
AIRBORNE = 0.4
"""Below this share of the weight on the floor there is no ZMP to speak of."""


@cache
def plain_model() -> mujoco.MjModel:
    """The declared robot without contacts and limits, so that inverse dynamics gives what the floor must supply."""
    model = build_model()
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    return model


def solve(plan: Plan) -> np.ndarray:
    """Joint-space trajectory that does what the plan says: qpos (T, 30)."""
    com = com_from_zmp(plan, plan.zmp)
    for _ in range(FILTER_PASSES):
        qpos = inverse_kinematics(plan, com)
        error = (plan.zmp - zmp(qpos)) * (load(plan) > AIRBORNE)[:, None]
        error[[0, -1]] = 0.0
        com = com + com_from_zmp(plan, error)
    return inverse_kinematics(plan, com)


def load(plan: Plan) -> np.ndarray:
    """Share of the weight that the height's acceleration leaves on the floor, (T,), 1 at rest."""
    acceleration = np.gradient(np.gradient(plan.height, DT), DT)
    share = 1 + acceleration / GRAVITY
    share[~plan.contact.any(axis=1)] = 0.0
    return share


def com_from_zmp(plan: Plan, target: np.ndarray) -> np.ndarray:
    """Centre of mass (T, 2) whose cart-table ZMP is `target` (T, 2) [m], resting on it at both ends."""
    share = np.maximum(load(plan), 0.0)
    height = plan.height if plan.ballistic else plan.height - 0.094
    lever = height / GRAVITY / DT**2
    bands = np.stack([-lever, share + 2 * lever, -lever])
    bands[1, [0, -1]] = 1.0
    right = share[:, None] * target
    right[[0, -1]] = target[[0, -1]]
    upper, lower = np.zeros_like(lever), np.zeros_like(lever)
    upper[2:], lower[:-2] = bands[0, 1:-1], bands[2, 1:-1]
    com = solve_banded((1, 1), np.stack([upper, bands[1], lower]), right)
    return _rested(com, plan.time)


def _rested(com: np.ndarray, time: np.ndarray) -> np.ndarray:
    """The same, eased into its first and last value: the solution leans ahead of the ZMP's first move by millimetres."""
    start, end = ease(time / END_EASE)[:, None], ease((time[-1] - time) / END_EASE)[:, None]
    com = com[0] + (com - com[0]) * start
    return com[-1] + (com - com[-1]) * end


def inverse_kinematics(plan: Plan, com: np.ndarray) -> np.ndarray:
    """qpos (T, 30) with feet, pelvis orientation and upper body as planned and the centre of mass over `com`."""
    model = plain_model()
    data = mujoco.MjData(model)
    pelvis = _quats(plan.pelvis)
    feet = _quats(np.stack([plan.foot_yaw, plan.foot_pitch, np.zeros_like(plan.foot_yaw)], axis=-1))
    data.qpos[:3] = [com[0, 0] + ANKLE_X * 0.5, com[0, 1], PELVIS_HEIGHT]
    data.qpos[7:] = stand_pose()
    out = np.empty((len(com), model.nq))
    for k in range(len(com)):
        data.qpos[3:7] = pelvis[k]
        data.qpos[19:] = plan.upper[k]
        if not plan.ballistic:
            data.qpos[2] = plan.height[k]
        _newton(model, data, plan, com[k], feet[k], k)
        out[k] = data.qpos
        if k > 0:  # start the next frame where this one's speed leads
            data.qpos[7:19] += 0.9 * (out[k, 7:19] - out[k - 1, 7:19])
            data.qpos[:3] += out[k, :3] - out[k - 1, :3]
    return out


def _newton(
    model: mujoco.MjModel, data: mujoco.MjData, plan: Plan, com: np.ndarray, feet: np.ndarray, frame: int
) -> None:
    ids = [model.body(name).id for name in FEET]
    dofs = np.concatenate([[0, 1, 2], LEG_DOFS])
    jacobian, turn = np.zeros((15, model.nv)), np.zeros(3)
    error = np.zeros(15)
    for _ in range(NEWTON_STEPS):
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        for i, body in enumerate(ids):
            row = 6 * i
            mujoco.mj_jacBody(model, data, jacobian[row : row + 3], jacobian[row + 3 : row + 6], body)
            error[row : row + 3] = plan.foot_pos[frame, i] - data.xpos[body]
            mujoco.mju_subQuat(turn, feet[i], data.xquat[body])
            error[row + 3 : row + 6] = data.xmat[body].reshape(3, 3) @ turn
        mujoco.mj_jacSubtreeCom(model, data, jacobian[12:15], 1)
        error[12:14] = com - data.subtree_com[1, :2]
        if plan.ballistic:
            error[14] = plan.height[frame] - data.subtree_com[1, 2]
        else:
            jacobian[14] = 0.0
            jacobian[14, 2] = 1.0
            error[14] = plan.height[frame] - data.qpos[2]
        if np.abs(error).max() < TOLERANCE:
            return
        step = np.linalg.solve(jacobian[:, dofs], error)
        step *= min(1.0, 0.3 / np.abs(step).max())
        data.qpos[:3] += step[:3]
        data.qpos[7:19] += step[3:]
    worst = np.abs(error).max()
    raise BadInput(f"embedded motion, frame {frame}", "a pose within reach", f"{worst:.4f} m of error", "Step shorter.")


def _quats(angles: np.ndarray) -> np.ndarray:
    """Quaternions wxyz of yaw, pitch, roll (..., 3): about z, then the new y, then the new x."""
    c, s = np.cos(angles / 2), np.sin(angles / 2)
    (cz, cy, cx), (sz, sy, sx) = np.moveaxis(c, -1, 0), np.moveaxis(s, -1, 0)
    quats = [cx * cy * cz + sx * sy * sz, sx * cy * cz - cx * sy * sz]
    quats += [cx * sy * cz + sx * cy * sz, cx * cy * sz - sx * sy * cz]
    return np.stack(quats, axis=-1)


def derivatives(qpos: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Central differences of qpos (T, 30): qvel and qacc (T, 29); before and after the clip the robot rests."""
    model = plain_model()
    half = np.zeros((len(qpos) + 1, model.nv))
    for k in range(len(qpos) - 1):
        mujoco.mj_differentiatePos(model, half[k + 1], DT, qpos[k], qpos[k + 1])
    return (half[1:] + half[:-1]) / 2, (half[1:] - half[:-1]) / DT


def floor_wrench(qpos: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """What the floor must supply: force and moment about the world's origin (T, 6), and the generalised force (T, 29)."""
    model = plain_model()
    data = mujoco.MjData(model)
    qvel, qacc = derivatives(qpos)
    wrench, generalised = np.empty((len(qpos), 6)), np.empty((len(qpos), model.nv))
    for k in range(len(qpos)):
        data.qpos[:], data.qvel[:], data.qacc[:] = qpos[k], qvel[k], qacc[k]
        mujoco.mj_inverse(model, data)
        force = data.qfrc_inverse[:3]
        torque = data.xmat[1].reshape(3, 3) @ data.qfrc_inverse[3:6]
        wrench[k] = np.concatenate([force, torque + np.cross(qpos[k, :3], force)])
        generalised[k] = data.qfrc_inverse
    return wrench, generalised


def zmp(qpos: np.ndarray) -> np.ndarray:
    """Zero-moment point of the whole body (T, 2) [m]; the stand's middle where the floor carries nothing."""
    wrench, _ = floor_wrench(qpos)
    weight = np.maximum(wrench[:, 2], AIRBORNE * 33 * GRAVITY)
    return np.stack([-wrench[:, 4] / weight, wrench[:, 3] / weight], axis=1)
