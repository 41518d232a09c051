"""From a plan to joint angles: centre of mass from the ZMP, inverse kinematics, a correction by full dynamics.

1. Cart-table model: (g + z'') x - z x'' = (g + z'') p has one bounded solution x for a ZMP p, and over a clip
   that starts and ends at rest it is a tridiagonal system.
2. Waist, arms and the pelvis' orientation are given, so two feet (12), the centre of mass (2) and a height (1)
   determine the 12 leg joints and the pelvis' position: Newton's method, warm-started frame by frame.
3. The ZMP of the whole body by inverse dynamics differs from the plan's as limbs swing; its error goes through
   step 1 and is added to the centre of mass (the dynamic filter of Kajita et al., 2003).
"""

from dataclasses import dataclass
from functools import cache

import mujoco
import numpy as np
from scipy.linalg import solve_banded

from bumblebee.errors import BadInput
from bumblebee.motion.embedded.flight import spare_moment
from bumblebee.motion.embedded.plan import ANKLE_X, FPS, PELVIS_HEIGHT, Plan, ease
from bumblebee.robot.facts import FEET, stand_pose
from bumblebee.robot.model import build_model

GRAVITY = 9.81
DT = 1.0 / FPS
FILTER_PASSES, FLIGHT_PASSES = 3, 6
NEWTON_STEPS = 30
TOLERANCE = 1e-7
END_EASE = 0.4  # s
LARGEST_STEP = 0.3  # rad or m
FREE_DOFS = np.r_[0:3, 6:18]  # the pelvis' position and the legs
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
    com, qpos = com_from_zmp(plan, plan.zmp), None
    for _ in range(FLIGHT_PASSES if plan.ballistic else FILTER_PASSES):
        qpos = inverse_kinematics(plan, com, qpos)
        wrench, _ = floor_wrench(qpos)
        if plan.ballistic:
            moment = wrench[:, 4] - (plan.height * wrench[:, 0] - com[:, 0] * wrench[:, 2])
            plan = spare_moment(plan, moment)
        error = (plan.zmp - zmp(wrench)) * (load(plan) > AIRBORNE)[:, None]
        error[[0, -1]] = 0.0
        com = com + com_from_zmp(plan, error)
    return inverse_kinematics(plan, com, qpos)


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
    """Path eased into its first and last value: it leads the ZMP's first move by millimetres."""
    start, end = ease(time / END_EASE)[:, None], ease((time[-1] - time) / END_EASE)[:, None]
    com = com[0] + (com - com[0]) * start
    return com[-1] + (com - com[-1]) * end


@dataclass(frozen=True)
class _Work:
    """The model's state and the arrays that Newton's method writes to, with views of their parts."""

    model: mujoco.MjModel
    data: mujoco.MjData
    feet: tuple[int, int]
    jacobian: np.ndarray
    error: np.ndarray
    turn: np.ndarray


def inverse_kinematics(plan: Plan, com: np.ndarray, guess: np.ndarray | None = None) -> np.ndarray:
    """The `qpos` (T, 30) with feet, pelvis and upper body as planned and the centre of mass over `com` (T, 2).

    It starts each frame from the `guess` (T, 30), or from where the frames before lead.
    """
    model = plain_model()
    data = mujoco.MjData(model)
    feet_ids = (model.body(FEET[0]).id, model.body(FEET[1]).id)
    work = _Work(model, data, feet_ids, np.zeros((15, model.nv)), np.zeros(15), np.zeros(3))
    pelvis = _quats(plan.pelvis)
    feet = _quats(np.stack([plan.foot_yaw, plan.foot_pitch, np.zeros_like(plan.foot_yaw)], axis=-1))
    data.qpos[:3] = [com[0, 0] + ANKLE_X * 0.5, com[0, 1], PELVIS_HEIGHT]
    data.qpos[7:] = stand_pose()
    out = np.empty((len(com), model.nq))
    for k in range(len(com)):
        if guess is not None:
            data.qpos[:] = guess[k]
        elif k > 1:
            data.qpos[7:19] += out[k - 1, 7:19] - out[k - 2, 7:19]
            data.qpos[:3] += out[k - 1, :3] - out[k - 2, :3]
        data.qpos[3:7] = pelvis[k]
        data.qpos[19:] = plan.upper[k]
        if not plan.ballistic:
            data.qpos[2] = plan.height[k]
        worst = _newton(work, plan, com[k], feet[k], k)
        if worst >= TOLERANCE:
            where = f"embedded motion, frame {k}"
            raise BadInput(where, "a pose within reach", f"{worst:.4f} m of error", "Step shorter or vary less.")
        out[k] = data.qpos
    return out


def _newton(work: _Work, plan: Plan, com: np.ndarray, feet: np.ndarray, frame: int) -> float:
    """Bring `work.data.qpos` to the frame's targets; returns the largest error that is left [m or rad]."""
    model, data, jacobian, error = work.model, work.data, work.jacobian, work.error
    for _ in range(NEWTON_STEPS):
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        for i, body in enumerate(work.feet):
            row = 6 * i
            mujoco.mj_jacBody(model, data, jacobian[row : row + 3], jacobian[row + 3 : row + 6], body)
            error[row : row + 3] = plan.foot_pos[frame, i] - data.xpos[body]
            mujoco.mju_subQuat(work.turn, feet[i], data.xquat[body])
            error[row + 3 : row + 6] = data.xmat[body].reshape(3, 3) @ work.turn
        mujoco.mj_jacSubtreeCom(model, data, jacobian[12:15], 1)
        error[12:14] = com - data.subtree_com[1, :2]
        if plan.ballistic:
            error[14] = plan.height[frame] - data.subtree_com[1, 2]
        else:
            jacobian[14] = 0.0
            jacobian[14, 2] = 1.0
            error[14] = plan.height[frame] - data.qpos[2]
        worst = float(np.abs(error).max())
        if worst < TOLERANCE:
            break
        step = np.linalg.solve(jacobian[:, FREE_DOFS], error)
        step *= min(1.0, LARGEST_STEP / np.abs(step).max())
        data.qpos[:3] += step[:3]
        data.qpos[7:19] += step[3:]
    return worst


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
    """Wrench of the floor, force and moment about the world's origin (T, 6), and generalised forces (T, 29)."""
    model = plain_model()
    data = mujoco.MjData(model)
    qvel, qacc = derivatives(qpos)
    wrench, generalised = np.empty((len(qpos), 6)), np.empty((len(qpos), model.nv))
    for k in range(len(qpos)):
        data.qpos[:], data.qvel[:], data.qacc[:] = qpos[k], qvel[k], qacc[k]
        mujoco.mj_inverse(model, data)
        wrench[k, :3] = data.qfrc_inverse[:3]
        wrench[k, 3:] = data.xmat[1].reshape(3, 3) @ data.qfrc_inverse[3:6]
        generalised[k] = data.qfrc_inverse
    wrench[:, 3:] += np.cross(qpos[:, :3], wrench[:, :3])
    return wrench, generalised


def zmp(wrench: np.ndarray) -> np.ndarray:
    """Zero-moment point (T, 2) [m] of a `floor_wrench` (T, 6); it means nothing where the floor carries little."""
    weight = np.maximum(wrench[:, 2], AIRBORNE * 33 * GRAVITY)
    return np.stack([-wrench[:, 4] / weight, wrench[:, 3] / weight], axis=1)
