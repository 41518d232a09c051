"""A variation: the declared model with some effects, as a compiled model plus what acts on commands and readings."""

import copy
from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from bumblebee.diagnosis.plant import Plant
from bumblebee.sim.effect_catalogue import CATALOGUE, STICTION_SOLIMP, STICTION_SOLREF, Effect

_ORDER = tuple(CATALOGUE)


@dataclass(frozen=True, eq=False)
class Variation:
    """One model to simulate."""

    model: mujoco.MjModel
    delay: np.ndarray
    """(nu,) command delay [s]."""
    offset: np.ndarray
    """(J,) what the encoder adds to the joint's position [rad], in the log's column order."""


def vary(plant: Plant, effects: Sequence[Effect]) -> Variation:
    """The plant with `effects`; the same meaning as `sim.effect_spec.add_to_spec`, without compiling again."""
    if not effects:
        return Variation(plant.model, plant.delay, plant.offset)
    model, delay, offset = copy.copy(plant.model), plant.delay.copy(), plant.offset.copy()
    constants = False
    for effect in sorted(effects, key=lambda e: _ORDER.index(e.effect)):
        for place in effect.where:
            constants |= _apply(plant, model, delay, offset, effect.effect, place, effect.value())
    if constants:
        # set_const reads qpos0 through a scratch MjData; gains, friction and damping do not enter it.
        mujoco.mj_setConst(model, mujoco.MjData(model))
    return Variation(model, delay, offset)


def _apply(
    plant: Plant, model: mujoco.MjModel, delay: np.ndarray, offset: np.ndarray, kind: str, place: str, value: float
) -> bool:
    """Write one effect; True if constants that derive from the model must be computed again."""
    if kind == "link_mass":
        model.body_mass[model.body(place).id] = value
        return True
    column = plant.joints.index(place)
    dof, actuator = plant.dof[column], plant.actuator[column]
    if kind == "coulomb_friction":
        model.dof_frictionloss[dof] = value
        model.dof_solref[dof], model.dof_solimp[dof, :2] = STICTION_SOLREF, STICTION_SOLIMP
    elif kind == "viscous_friction":
        model.dof_damping[dof] = value
    elif kind == "armature":
        model.dof_armature[dof] = value
        return True
    elif kind == "command_delay":
        delay[actuator] = value
    elif kind == "encoder_offset":
        offset[column] = value
        model.actuator_biasprm[actuator, 0] = (
            model.actuator_biasprm[actuator, 1] * value * model.actuator_gear[actuator, 0]
        )
    else:
        kp = value if kind in ("motor_strength", "kp") else 1.0
        kd = value if kind in ("motor_strength", "kd") else 1.0
        model.actuator_gainprm[actuator, 0] *= kp
        model.actuator_biasprm[actuator, :3] *= [kp, kp, kd]
    return False


def declared_value(plant: Plant, kind: str, place: str) -> float:
    """The parameter of an effect as the declared model has it."""
    if kind == "link_mass":
        return float(plant.model.body_mass[plant.model.body(place).id])
    column = plant.joints.index(place)
    dof = plant.dof[column]
    if kind == "coulomb_friction":
        return float(plant.model.dof_frictionloss[dof])
    if kind == "viscous_friction":
        return float(plant.model.dof_damping[dof])
    if kind == "armature":
        return float(plant.model.dof_armature[dof])
    if kind == "command_delay":
        return float(plant.delay[plant.actuator[column]])
    if kind == "encoder_offset":
        return float(plant.offset[column])
    return 1.0
