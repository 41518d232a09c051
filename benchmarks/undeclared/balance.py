"""Standing of any humanoid: linear-quadratic feedback about its declared stand, and how its hips are lowered.

The declared model is linearised with its soles on the floor (mjd_transitionFD), control is held for a tick. The weights
ask for a centre of mass above where it stood and an upright base; the joints may move.
"""

from dataclasses import dataclass

import mujoco
import numpy as np
from scipy.linalg import solve_discrete_are

from bumblebee.robot.facts import FEET, SIDES, limb
from bumblebee.stand_in.undeclared.declared import Declared

_SINK = np.linspace(-0.01, 0.005, 301)  # m, heights about the stand at which the soles may carry the weight
_CENTRE, _UPRIGHT, _STILL, _EFFORT = 1000.0, 10.0, 0.01, 10.0  # weights: 1/m^2, 1/rad^2, 1/(rad/s)^2, 1/rad^2
_MOST = 0.5  # rad, by which feedback moves a target


@dataclass(frozen=True, eq=False)
class Balance:
    """Feedback of a standing robot."""

    model: mujoco.MjModel
    home: np.ndarray
    """(nq,) stand at the height where the soles carry the weight."""
    target: np.ndarray
    """(J,) joint targets that hold it there [rad]."""
    gain: np.ndarray
    """(J, 2 nv)."""
    lower: np.ndarray
    """(J,) joints' change per metre by which the hips are lowered over feet that stay [rad/m]."""

    def targets(self, moved: np.ndarray, lowered: np.ndarray, qpos: np.ndarray, qvel: np.ndarray) -> np.ndarray:
        """Targets (R, J) [rad] of robots in states (R, nq), (R, nv) that are to have moved (R, J) and lowered (R,) [m].

        `moved` holds what lowering asks of the joints, too.
        """
        off, goal = np.zeros((len(qpos), self.model.nv)), self.home.copy()
        for r in range(len(qpos)):
            goal[2], goal[7:] = self.home[2] - lowered[r], self.home[7:] + moved[r]
            mujoco.mj_differentiatePos(self.model, off[r], 1.0, goal, qpos[r])
        feedback = np.concatenate((off, qvel), axis=1) @ self.gain.T
        return self.target + moved - np.clip(feedback, -_MOST, _MOST)


def balance_of(robot: Declared, hz: float) -> Balance:
    """Feedback of a robot's declared model in its stand, `hz` times a second."""
    model = robot.spec.compile()
    data = mujoco.MjData(model)
    home, force = _carried(model, data)
    target = home[7:] + force[6:] / robot.kp
    data.qpos, data.ctrl = home, target
    mujoco.mj_forward(model, data)
    return Balance(model, home, target, _gain(model, data, hz), _lowering(robot, model, data))


def _carried(model: mujoco.MjModel, data: mujoco.MjData) -> tuple[np.ndarray, np.ndarray]:
    """The stand (nq,) at the height where least force is missing at the base, and the forces (nv,) it takes there."""
    found = []
    for sink in _SINK:
        mujoco.mj_resetDataKeyframe(model, data, model.key("stand").id)
        data.qpos[2] += sink
        mujoco.mj_inverse(model, data)
        found.append((abs(data.qfrc_inverse[2]), data.qpos.copy(), data.qfrc_inverse.copy()))
    _, home, force = min(found, key=lambda one: one[0])
    return home, force


def _gain(model: mujoco.MjModel, data: mujoco.MjData, hz: float) -> np.ndarray:
    """Gain (J, 2 nv) that minimises the weighted squares, control held for 1 / hz."""
    nv, step = model.nv, np.zeros((2 * model.nv, 2 * model.nv))
    push = np.zeros((2 * nv, model.nu))
    mujoco.mjd_transitionFD(model, data, 1e-6, True, step, push, None, None)
    whole, pushed = np.eye(2 * nv), np.zeros_like(push)
    for _ in range(round(1 / hz / model.opt.timestep)):
        whole, pushed = step @ whole, step @ pushed + push
    centre = np.zeros((3, nv))
    mujoco.mj_jacSubtreeCom(model, data, centre, 1)
    state = np.diag([0.0] * 3 + [_UPRIGHT] * 3 + [1.0] * (nv - 6) + [_STILL] * nv)
    state[:nv, :nv] += _CENTRE * centre[:2].T @ centre[:2]
    effort = _EFFORT * np.eye(model.nu)
    cost = solve_discrete_are(whole, pushed, state, effort)
    return np.linalg.solve(effort + pushed.T @ cost @ pushed, pushed.T @ cost @ whole)


def _lowering(robot: Declared, model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
    """Joints' change (J,) [rad/m] that brings both feet nearer to the hips, level as they are."""
    found = np.zeros(len(robot.joints))
    for side, foot in zip(SIDES, FEET, strict=True):
        leg = [robot.joints.index(name) for name in limb(side, "foot")]
        move, turn = np.zeros((3, model.nv)), np.zeros((3, model.nv))
        mujoco.mj_jacBody(model, data, move, turn, model.body(foot).id)
        whole = np.concatenate((move, turn))[:, 6:][:, leg]
        found[leg] = np.linalg.lstsq(whole, np.array([0.0, 0, 1, 0, 0, 0]), rcond=None)[0]
    return found
