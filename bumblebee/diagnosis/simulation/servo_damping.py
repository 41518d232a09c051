"""How fast a robot is damped: a joint without inertia comes to rest within a step, and no step shows how."""

import mujoco
import numpy as np
from scipy.linalg import eigh

from bumblebee.diagnosis.simulation.plant import Plant
from bumblebee.diagnosis.simulation.variation import Variation
from bumblebee.diagnosis.simulation.windows import Windows
from bumblebee.robot.drives import ON_JOINT

_KINDS = (int(mujoco.mjtJoint.mjJNT_SLIDE), int(mujoco.mjtJoint.mjJNT_HINGE))


def damping_rates(plant: Plant, variation: Variation, windows: Windows, joints: bool = False) -> np.ndarray:
    """The fastest rate (W,) [1/s] at which servos damp a variation of `plant` where windows start.

    Explicit steps of more than its inverse shake: a joint is turned round by its damping before it flies away, and what
    they change is no simulator's error. The joints' own damping (`joints`) brings a robot to rest, too; Euler's steps
    take it implicitly unless that is switched off. Infinite where a joint has no inertia.
    """
    own = variation.model.nq == windows.qpos.shape[1]  # a gap or a shaft adds joints that no log has
    models = variation.models if own else tuple(p.model for p in plant.every)
    out = np.empty(len(windows))
    for number in np.unique(windows.condition):
        mine = windows.condition == number
        out[mine] = _rates(models[number], windows.qpos[mine], joints)
    return out


def _rates(model: mujoco.MjModel, qpos: np.ndarray, joints: bool) -> np.ndarray:
    damping = _of_servos(model) + (model.dof_damping if joints else 0.0)
    data, inertia, rates = mujoco.MjData(model), np.zeros((model.nv, model.nv)), np.zeros(len(qpos))
    if not damping.any():
        return rates
    for w, pose in enumerate(qpos):
        data.qpos[:] = pose
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fullM(model, data, inertia)
        rates[w] = _fastest(np.diag(damping), inertia)
    return rates


def _of_servos(model: mujoco.MjModel) -> np.ndarray:
    """Damping (nv,) of all actuators on each hinge or slide together, [N m s/rad] or [N s/m]."""
    damping = np.zeros(model.nv)
    for a in range(model.nu):
        if model.actuator_trntype[a] in ON_JOINT and model.jnt_type[model.actuator_trnid[a, 0]] in _KINDS:
            dof = model.jnt_dofadr[model.actuator_trnid[a, 0]]
            damping[dof] -= model.actuator_gear[a, 0] ** 2 * model.actuator_biasprm[a, 2]
    return np.maximum(damping, 0.0)


def _fastest(damping: np.ndarray, inertia: np.ndarray) -> float:
    """The largest eigenvalue of the inverse inertia (nv, nv) times the damping (nv, nv)."""
    most = len(inertia) - 1
    try:
        return float(eigh(damping, inertia, eigvals_only=True, subset_by_index=[most, most])[0])
    except np.linalg.LinAlgError:
        return np.inf
