"""The model of a robot as it is, compiled."""

from collections.abc import Sequence

import mujoco

from bumblebee.stand_in.undeclared.declared import Declared
from bumblebee.stand_in.undeclared.law import Law

SOLVER = 50  # iterations: the declared G1's 5 of 6 line-search steps do not converge on dry friction
_STIFF = (0.004, 1.0), (0.999, 0.999)  # solref and solimp of dry friction


def true_model(robot: Declared, laws: Sequence[Law], step: float, solver: int | None) -> mujoco.MjModel:
    """The declared model with what laws change in it, at steps of `step` [s], moved by torques from outside alone.

    Args:
        robot: what is declared.
        laws: what is not.
        step: of the mechanics [s].
        solver: iterations; None for those that are declared, but where a law rubs.
    """
    spec = robot.spec.copy()
    for law in laws:
        law.spec(spec)
    for key in list(spec.keys):
        spec.delete(key)
    spec.option.timestep, spec.option.integrator = step, mujoco.mjtIntegrator.mjINT_EULER
    rubs = bool(overriding(laws, "friction"))
    if solver is not None or rubs:
        spec.option.iterations = spec.option.ls_iterations = solver or SOLVER
    spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)
    model = spec.compile()
    dofs = [model.joint(name).dofadr[0] for name in robot.joints]
    if rubs:
        model.dof_solref[dofs], model.dof_solimp[dofs, :2] = _STIFF
    for law in sorted(laws, key=lambda law: not law.first):
        law.model(model)
    mujoco.mj_setConst(model, mujoco.MjData(model))
    return model


def overriding(laws: Sequence[Law], hook: str) -> tuple[int, ...]:
    """Which of the laws do something at a hook of `Law`."""
    return tuple(i for i, law in enumerate(laws) if getattr(type(law), hook) is not getattr(Law, hook))
