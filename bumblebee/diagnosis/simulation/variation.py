"""A variation: the declared model with some effects, as a compiled model plus what acts on commands and readings."""

import copy
from collections.abc import Sequence
from dataclasses import dataclass, field

import mujoco
import numpy as np

from bumblebee.diagnosis.simulation.declared import touching
from bumblebee.diagnosis.simulation.plant import Plant, make_plant
from bumblebee.sim.effects import (
    CATALOGUE,
    STICTION_SOLIMP,
    STICTION_SOLREF,
    Effect,
    RuntimeHooks,
    add_to_spec,
    native,
    runtime_hooks,
)

_ORDER = tuple(CATALOGUE)
# Effects that change the layout of MuJoCo's state: they are compiled, once for each set of places.
STRUCTURAL = ("backlash", "series_elasticity", "hysteresis")


@dataclass(frozen=True, eq=False)
class Variation:
    """One model to simulate."""

    model: mujoco.MjModel
    delay: np.ndarray
    """(nu,) command delay [s]."""
    offset: np.ndarray
    """(J,) what the encoder adds to the joint's position [rad], in the log's column order."""
    plant: Plant | None = None
    """The plant of `model` where its structure differs from the declared one's."""
    hooks: RuntimeHooks | None = None
    """What must be done beside MuJoCo at every step."""
    dropped: np.ndarray | None = None
    """(nu,) share of commands that never arrive."""
    tilt: np.ndarray | None = None
    """(3,) [rad] rotation vector multiplied onto the reading of the base's orientation."""
    hidden: tuple[tuple[str, str, tuple[float, ...]], ...] = field(default=())
    """(kind, joint, parameters) of the structural effects, for the state that no sensor reads."""

    @property
    def plain(self) -> bool:
        """Whether a model and a delay are all there is to it."""
        return self.plant is None and self.hooks is None and self.tilt is None and self.dropped is None


def vary(plant: Plant, effects: Sequence[Effect]) -> Variation:
    """The plant with `effects`; the same meaning as `sim.effects.spec.add_to_spec`, without compiling again."""
    if not effects:
        return Variation(plant.model, plant.delay, plant.offset)
    structural = [e for e in effects if _is_structural(e)]
    own = _structure(plant, structural) if structural else plant
    model, delay, offset = copy.copy(own.model), plant.delay.copy(), plant.offset.copy()
    constants, hidden = False, []
    for effect in sorted(effects, key=lambda e: _ORDER.index(e.effect)):
        for place in effect.where or _everywhere(plant, effect.effect):
            constants |= _apply(own, model, delay, offset, effect, place)
            if _is_structural(effect):
                hidden.append((effect.effect, place, effect.values()))
    _set_rotors(plant, own, model, hidden, {place for e in effects if e.effect == "armature" for place in e.where})
    if constants:
        # set_const reads qpos0 through a scratch MjData; gains, friction and damping do not enter it.
        mujoco.mj_setConst(model, mujoco.MjData(model))
    hooks = runtime_hooks(effects, model)
    return Variation(
        model,
        delay,
        offset,
        plant=own if structural else None,
        hooks=hooks if hooks.steps else None,
        dropped=_dropped(plant, hooks),
        tilt=hooks.imu if hooks.imu.any() else None,
        hidden=tuple(hidden),
    )


def _set_rotors(
    plant: Plant, own: Plant, model: mujoco.MjModel, hidden: Sequence[tuple[str, str, tuple[float, ...]]], new: set[str]
) -> None:
    """Divide the declared armature, or that fitted on the joints `new`, between rotor and link behind play and shafts.

    The encoder's side has it on its own hinge, the other side as the inertia of a tendon along both.
    """
    for kind, place, values in hidden:
        share = values[3] if kind == "series_elasticity" else 0.0
        if kind not in native.SUFFIX or not (values[1] or share):
            continue
        column = plant.joints.index(place)
        dof, tendon = own.dof[column], model.tendon(native.rotor_of(kind, place)).id
        armature = model.dof_armature[dof] if place in new else plant.model.dof_armature[plant.dof[column]]
        if values[1]:
            armature = max(armature, native.HIDDEN_ARMATURE)
        behind = 1 - share if values[1] else share
        model.tendon_armature[tendon], model.dof_armature[dof] = behind * armature, (1 - behind) * armature


def _is_structural(effect: Effect) -> bool:
    """Whether the effect changes the layout of MuJoCo's state; hysteresis by Dahl's law is a hook."""
    return effect.effect in STRUCTURAL and not (effect.effect == "hysteresis" and effect.values()[2])


def _dropped(plant: Plant, hooks: RuntimeHooks) -> np.ndarray | None:
    if not hooks.dropped.any():
        return None
    share = np.zeros(plant.model.nu)
    for name, value in zip(hooks.joints, hooks.dropped, strict=True):
        actuator = plant.actuator[plant.joints.index(name)]
        if actuator >= 0:
            share[actuator] = value
    return share


def _everywhere(plant: Plant, kind: str) -> tuple[str, ...]:
    """The places that `where: []` stands for."""
    if not CATALOGUE[kind].whole:
        return ("",)
    return tuple(name for name, a in zip(plant.joints, plant.actuator, strict=True) if a >= 0)


def _structure(plant: Plant, effects: Sequence[Effect]) -> Plant:
    """The plant compiled with play, shafts and yielding springs; their sizes are set afterwards."""
    key = tuple(sorted((e.effect, e.where, _form(e)) for e in effects))
    if key not in plant.compiled:
        spec = plant.spec.copy()
        add_to_spec(spec, effects)
        plant.compiled[key] = make_plant(spec, plant.example, "declared model", plant.thresholds)
    return plant.compiled[key]


def _form(effect: Effect) -> tuple[bool, ...]:
    """What of play and shafts decides on the structure: where the encoder is, whether the rotor is divided."""
    if effect.effect not in native.SUFFIX:
        return ()
    return tuple(bool(value) for value in (effect.values()[1], *effect.values()[3:]))


def _apply(
    plant: Plant, model: mujoco.MjModel, delay: np.ndarray, offset: np.ndarray, effect: Effect, place: str
) -> bool:
    """Write one effect; True if constants that derive from the model must be computed again."""
    kind, values = effect.effect, effect.values()
    if CATALOGUE[kind].on == "body":
        return _apply_to_body(model, kind, place, values)
    if CATALOGUE[kind].on == "geom":
        _apply_to_ground(model, kind, place, values[0])
        return False
    if kind == "ground_slope":
        model.opt.gravity = native.sloped(model.opt.gravity, *values)
        return False
    column = plant.joints.index(place)
    if kind == "discovered":  # a hook; its terms may be dry friction, which has to stick
        dof = plant.dof[column]
        model.dof_solref[dof], model.dof_solimp[dof, :2] = STICTION_SOLREF, STICTION_SOLIMP
        return False
    _apply_to_joint(plant, model, kind, column, values)
    if kind == "command_delay":
        delay[plant.actuator[column]] = values[0]
    elif kind == "encoder_offset":
        offset[column] = values[0]
    return kind in ("armature", *STRUCTURAL)


def _apply_to_joint(plant: Plant, model: mujoco.MjModel, kind: str, column: int, values: tuple[float, ...]) -> None:
    dof, a, value = plant.dof[column], plant.actuator[column], values[0]
    joint = int(model.dof_jntid[dof])
    if kind in ("coulomb_friction", "stribeck_friction", "load_dependent_friction"):
        model.dof_solref[dof], model.dof_solimp[dof, :2] = STICTION_SOLREF, STICTION_SOLIMP
        if kind == "coulomb_friction":
            model.dof_frictionloss[dof] = value
    elif kind == "viscous_friction":
        model.dof_damping[dof] = value
    elif kind == "armature":
        model.dof_armature[dof] = value
    elif kind == "encoder_offset":
        if a >= 0:
            model.actuator_biasprm[a, 0] = model.actuator_biasprm[a, 1] * value * model.actuator_gear[a, 0]
    elif kind == "torque_limit":
        force = value / abs(model.actuator_gear[a, 0])
        model.actuator_forcelimited[a], model.actuator_forcerange[a] = 1, (-force, force)
    elif kind in ("motor_strength", "kp", "kd"):
        kp = value if kind != "kd" else 1.0
        kd = value if kind != "kp" else 1.0
        model.actuator_gainprm[a, 0] *= kp
        model.actuator_biasprm[a, :3] *= [kp, kp, kd]
    elif kind == "asymmetric_friction":
        stiffness, rest = model.jnt_stiffness[joint], model.qpos_spring[model.jnt_qposadr[joint]]
        _set_spring(model, joint, stiffness, stiffness * rest - 0.5 * value)
    elif kind == "joint_spring":
        _set_spring(model, joint, *values)
    elif kind == "hysteresis":
        if not values[2]:
            model.jnt_stiffness[joint], model.jnt_springyield[joint] = value / values[1], values[1]
    elif kind in native.SUFFIX:
        second = int(model.joint(plant.joints[column] + native.SUFFIX[kind]).id)
        if kind == "backlash":
            model.jnt_range[second] = (-0.5 * value, 0.5 * value)
        else:
            model.jnt_stiffness[second] = value
            model.dof_damping[model.jnt_dofadr[second]] = values[2] * value


def _set_spring(model: mujoco.MjModel, joint: int, stiffness: float, preload: float) -> None:
    stiffness, rest = native.spring_of(float(stiffness), float(preload))
    model.jnt_stiffness[joint], model.qpos_spring[model.jnt_qposadr[joint]] = stiffness, rest


def _apply_to_body(model: mujoco.MjModel, kind: str, place: str, values: tuple[float, ...]) -> bool:
    body = model.body(place).id
    if kind == "link_mass":
        mass, spread = values
        factor = mass / model.body_mass[body]
        model.body_inertia[body] = native.spread_inertia(model.body_inertia[body], factor, spread)
        model.body_mass[body] = mass
    elif kind == "link_com":
        model.body_ipos[body] = values
    elif kind == "link_inertia":
        model.body_inertia[body] = native.physical_inertia(values)
    return kind in ("link_mass", "link_com", "link_inertia")


def _apply_to_ground(model: mujoco.MjModel, kind: str, place: str, value: float) -> None:
    ground = int(model.geom(place).id)
    others = touching(model, ground)
    if kind == "ground_friction":
        model.geom_friction[ground, 0] = value
        model.geom_friction[others, 0] = np.minimum(value, model.geom_friction[others, 0])
    else:
        model.geom_solref[[ground, *others], 0] = value
