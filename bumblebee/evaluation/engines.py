"""Facts of a model for the frozen evaluation: its solver's settings, and a hash of the robot in it."""

import hashlib
from typing import Any

import mujoco
import numpy as np

# What moves and how: everything that a success rate feels and that compiling on another machine does not change.
_FIELDS = (
    "body_mass", "body_inertia", "body_pos", "body_ipos", "jnt_range", "dof_armature", "dof_damping",
    "dof_frictionloss", "actuator_gainprm", "actuator_biasprm", "actuator_forcerange", "geom_size", "geom_pos",
    "geom_friction",
)  # fmt: skip


def engine_settings(model: mujoco.MjModel) -> dict[str, Any]:
    """Time step, integrator, friction cone, kind of actuators and `model_sha256`, read from the model that runs."""
    servo = bool((model.actuator_biastype == int(mujoco.mjtBias.mjBIAS_AFFINE)).all())
    return {
        "timestep": round(float(model.opt.timestep), 9),
        "integrator": mujoco.mjtIntegrator(model.opt.integrator).name.removeprefix("mjINT_").lower(),
        "cone": mujoco.mjtCone(model.opt.cone).name.removeprefix("mjCONE_").lower(),
        "actuators": "position servos" if servo else "torque motors",
        "model_sha256": model_digest(model),
    }


def model_digest(model: mujoco.MjModel) -> str:
    """sha256 of the robot's masses, geometry, joints and motors, to five digits."""
    digest = hashlib.sha256()
    for field in _FIELDS:
        values = np.round(np.asarray(getattr(model, field), dtype=np.float64), 10) + 0.0  # no negative nought
        digest.update(f"{field} {values.shape} {' '.join(f'{v:.5g}' for v in values.ravel())}\n".encode())
    return digest.hexdigest()
