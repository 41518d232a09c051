"""Declaration of a robot: its model, and the figures that the truth starts from."""

from dataclasses import dataclass

import mujoco
import numpy as np


@dataclass(frozen=True, eq=False)
class Declared:
    """One robot as its maker describes it; J joints in the model's order."""

    name: str
    spec: mujoco.MjSpec
    """5 ms, position servos."""
    joints: tuple[str, ...]
    bodies: tuple[str, ...]
    """Bodies that move and have a mass."""
    kp: np.ndarray
    """(J,) [N m/rad]."""
    kd: np.ndarray
    """(J,) [N m s/rad]."""
    limit: np.ndarray
    """(J,) [N m]."""
    armature: np.ndarray
    """(J,) [kg m^2]."""
    friction: np.ndarray
    """(J,) declared dry friction [N m]."""
    damping: np.ndarray
    """(J,) [N m s/rad]."""
    mass: dict[str, float]
    """Body -> [kg]."""
    floating: bool
    chained: dict[str, str]
    """Joint -> the hinge before it, for those that have one."""
    crossed: tuple[str, ...]
    """Those of them whose axis is not parallel to that one's."""


def describe(name: str, spec: mujoco.MjSpec) -> Declared:
    """Read what a model of position servos declares; a base that moves freely is told by its joint."""
    model = spec.compile()
    hinges = [j for j in range(model.njnt) if model.jnt_type[j] == int(mujoco.mjtJoint.mjJNT_HINGE)]
    dofs = model.jnt_dofadr[hinges]
    servo = {int(model.actuator_trnid[a, 0]): a for a in range(model.nu)}
    rows = [servo[j] for j in hinges]
    names = {j: model.joint(j).name for j in hinges}
    before = {j: found for j in hinges if (found := _hinge_before(model, j)) is not None}
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    moving = [b for b in range(1, model.nbody) if model.body_weldid[b] and model.body_mass[b] > 0]
    return Declared(
        name=name,
        spec=spec,
        joints=tuple(model.joint(j).name for j in hinges),
        bodies=tuple(model.body(b).name for b in moving),
        kp=model.actuator_gainprm[rows, 0].copy(),
        kd=-model.actuator_biasprm[rows, 2],
        limit=model.actuator_forcerange[rows, 1].copy(),
        armature=model.dof_armature[dofs].copy(),
        friction=model.dof_frictionloss[dofs].copy(),
        damping=model.dof_damping[dofs].copy(),
        mass={model.body(b).name: float(model.body_mass[b]) for b in moving},
        floating=int(mujoco.mjtJoint.mjJNT_FREE) in model.jnt_type,
        chained={names[j]: names[other] for j, other in before.items()},
        crossed=tuple(names[j] for j, other in before.items() if abs(data.xaxis[j] @ data.xaxis[other]) < 0.9),
    )


def _hinge_before(model: mujoco.MjModel, joint: int) -> int | None:
    """The last hinge on the way from the base to a joint of one of its own."""
    body = int(model.jnt_bodyid[joint])
    if joint > model.body_jntadr[body]:
        return joint - 1
    while body := int(model.body_parentid[body]):
        if model.body_jntnum[body]:
            last = int(model.body_jntadr[body] + model.body_jntnum[body] - 1)
            return last if model.jnt_type[last] == int(mujoco.mjtJoint.mjJNT_HINGE) else None
    return None
