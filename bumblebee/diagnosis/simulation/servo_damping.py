"""How fast servos damp a robot: a joint without inertia comes to rest within a step, and no step shows how."""

import mujoco
import numpy as np
from scipy.linalg import eigh

from bumblebee.diagnosis.simulation.plant import Plant
from bumblebee.diagnosis.simulation.variation import Variation
from bumblebee.diagnosis.simulation.windows import Windows
from bumblebee.sim.servo import servos_of


def damping_rates(plant: Plant, variation: Variation, windows: Windows) -> np.ndarray:
    """The fastest rate (W,) [1/s] at which servos damp a variation of `plant` where windows start.

    Explicit steps of more than its inverse shake: a joint is turned round by its damping before it flies away, and what
    they change is no simulator's error. Infinite where a joint has no inertia.
    """
    own = variation.model.nq == windows.qpos.shape[1]  # a gap or a shaft adds joints that no log has
    models = variation.models if own else tuple(p.model for p in plant.every)
    out = np.empty(len(windows))
    for number in np.unique(windows.condition):
        mine = windows.condition == number
        out[mine] = _rates(models[number], windows.qpos[mine])
    return out


def _rates(model: mujoco.MjModel, qpos: np.ndarray) -> np.ndarray:
    kinds = (int(mujoco.mjtJoint.mjJNT_SLIDE), int(mujoco.mjtJoint.mjJNT_HINGE))
    joints = [j for j in range(model.njnt) if int(model.jnt_type[j]) in kinds]
    servos, data, inertia = servos_of(model, joints), mujoco.MjData(model), np.zeros((model.nv, model.nv))
    damping, rates = np.zeros(model.nv), np.zeros(len(qpos))
    damping[servos.dof] = np.maximum(-servos.bias[:, 2], 0.0)
    if not damping.any():
        return rates
    for w, pose in enumerate(qpos):
        data.qpos[:] = pose
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fullM(model, data, inertia)
        rates[w] = _fastest(np.diag(damping), inertia)
    return rates


def _fastest(damping: np.ndarray, inertia: np.ndarray) -> float:
    """The largest eigenvalue of the inverse inertia (nv, nv) times the damping (nv, nv)."""
    most = len(inertia) - 1
    try:
        return float(eigh(damping, inertia, eigvals_only=True, subset_by_index=[most, most])[0])
    except np.linalg.LinAlgError:
        return np.inf
