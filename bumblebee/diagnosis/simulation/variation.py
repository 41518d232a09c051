"""A variation: the declared model with some effects, as a compiled model plus what acts on commands and readings."""

import copy
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import mujoco
import numpy as np

from bumblebee.diagnosis.simulation.declared import spot
from bumblebee.diagnosis.simulation.failures import REFUSALS, effects_in_words
from bumblebee.diagnosis.simulation.plant import Plant, make_plant
from bumblebee.diagnosis.simulation.starts.setpoints import SetPoint, setpoints_of
from bumblebee.errors import BadInput
from bumblebee.sim.effects import (
    CATALOGUE,
    SETPOINTS,
    Effect,
    RuntimeHooks,
    add_to_spec,
    in_order,
    native,
    runtime_hooks,
)


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
    """Actions beside MuJoCo at every step."""
    setpoints: tuple[SetPoint, ...] = ()
    """Set-points that drives make of their targets, on the way to the servos; as a delay it is in the controls."""
    dropped: np.ndarray | None = None
    """(nu,) share of commands that never arrive."""
    tilt: np.ndarray | None = None
    """(3,) [rad] rotation vector multiplied onto the reading of the base's orientation."""
    hidden: tuple[tuple[str, str, tuple[float, ...]], ...] = field(default=())
    """(kind, joint, parameters) of the structural effects, for the state that no sensor reads."""
    effects: tuple[Effect, ...] = ()
    """Effects that the declared model was given."""
    impossible: bool = False
    """Whether the model with these effects could not be made: `model` is then the declared one, residuals are NaN."""
    others: tuple[mujoco.MjModel, ...] = field(default=(), repr=False)
    """Models under the plant's other conditions; `model` is that of its own."""

    @property
    def models(self) -> tuple[mujoco.MjModel, ...]:
        """By number of the condition."""
        return (self.model, *self.others)

    @property
    def bare(self) -> "Variation":
        """Models, offsets and what becomes of single commands alone."""
        return Variation(self.model, self.delay, self.offset, setpoints=self.setpoints, others=self.others)

    @property
    def plain(self) -> bool:
        """Whether a model and what becomes of single commands on their way are all there is to it."""
        seen = all(CATALOGUE[kind].stateless for kind, _, _ in self.hidden)
        alone = seen and self.hooks is None and self.tilt is None and self.dropped is None
        return alone and not self.impossible

    def beside(self, other: "Variation") -> bool:
        """Whether both are plain and of one structure, so that one batch holds both."""
        return self.plain and other.plain and self.plant is other.plant


def vary(plant: Plant, effects: Sequence[Effect]) -> Variation:
    """The plant with `effects`; an `impossible` one, written down in `plant.failures`, where that cannot be made."""
    try:
        return _made(plant, effects)
    except REFUSALS as error:
        plant.failures.add(_blamed(plant, effects), error)
        models = tuple(other.model for other in plant.others)
        declared = Variation(plant.model, plant.delay, plant.offset, others=models)
        return replace(declared, effects=tuple(effects), impossible=True)


def _blamed(plant: Plant, effects: Sequence[Effect]) -> Sequence[Effect]:
    """The effect that cannot be made by itself; all of them where each can."""
    for effect in effects if len(effects) > 1 else ():
        try:
            _made(plant, [effect])
        except REFUSALS:
            return [effect]
    return effects


def vary_or_refuse(plant: Plant, effects: Sequence[Effect]) -> Variation:
    """Vary the plant by effects that a user demands: `BadInput` where the model cannot be made."""
    try:
        return _made(plant, effects)
    except REFUSALS as error:
        came = " ".join(str(error).split())[:300]
        raise BadInput(f"effects {effects_in_words(effects)}", "a model that MuJoCo can make of them", came) from error


def _made(plant: Plant, effects: Sequence[Effect]) -> Variation:
    """The plant with `effects`; the same meaning as `sim.effects.spec.add_to_spec`, without compiling again.

    Under several conditions it has a model for each: factors of gains multiply those of the condition.
    """
    own = _alone(plant, effects)
    return replace(own, others=tuple(_alone(o, effects).model for o in plant.others)) if plant.others else own


def _alone(plant: Plant, effects: Sequence[Effect]) -> Variation:
    """Vary the plant under its own condition alone."""
    if not effects:
        return Variation(plant.model, plant.delay, plant.offset)
    structural = [e for e in effects if _is_structural(e)]
    own = _structure(plant, structural) if structural else plant
    model, delay, offset = copy.copy(own.model), plant.delay.copy(), plant.offset.copy()
    hidden = []
    for effect in in_order(effects):
        kind = CATALOGUE[effect.effect]
        for place in effect.where or _everywhere(plant, kind.whole):
            if kind.added:
                kind.write(spot(own, place, model, delay, offset), *effect.values())
            if _is_structural(effect):
                hidden.append((effect.effect, place, effect.values()))
    _set_rotors(plant, own, model, hidden, {place for e in effects if e.effect == "armature" for place in e.where})
    kinds = [CATALOGUE[effect.effect] for effect in effects]
    if any(kind.constants or kind.structural for kind in kinds):
        # set_const reads qpos0 through a scratch MjData; gains, friction and damping do not enter it.
        mujoco.mj_setConst(model, mujoco.MjData(model))
    hooks = runtime_hooks([e for e in effects if e.effect not in SETPOINTS], model)
    return Variation(
        model,
        delay,
        offset,
        plant=own if structural else None,
        hooks=hooks if hooks.steps else None,
        setpoints=setpoints_of(plant, effects),
        dropped=_dropped(plant, hooks),
        tilt=hooks.imu if hooks.imu.any() else None,
        hidden=tuple(hidden),
        effects=tuple(effects),
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
    """Whether the effect changes the layout of MuJoCo's state: it is compiled, once for each set of places."""
    return CATALOGUE[effect.effect].reshapes(effect.values())


def _dropped(plant: Plant, hooks: RuntimeHooks) -> np.ndarray | None:
    if not hooks.dropped.any():
        return None
    share = np.zeros(plant.model.nu)
    for name, value in zip(hooks.joints, hooks.dropped, strict=True):
        actuator = plant.actuator[plant.joints.index(name)]
        if actuator >= 0:
            share[actuator] = value
    return share


def _everywhere(plant: Plant, whole: bool) -> tuple[str, ...]:
    """The places that `where: []` stands for."""
    if not whole:
        return ("",)
    return tuple(name for name, a in zip(plant.joints, plant.actuator, strict=True) if a >= 0)


def _structure(plant: Plant, effects: Sequence[Effect]) -> Plant:
    """The plant compiled with play, shafts and yielding springs; their sizes are set afterwards."""
    key = tuple(sorted((e.effect, e.where, _form(e)) for e in effects))
    if key not in plant.compiled:
        spec = plant.spec.copy()
        add_to_spec(spec, effects)
        plant.compiled[key] = make_plant(spec, plant.example, "declared model", plant.thresholds, plant.condition)
    return plant.compiled[key]


def _form(effect: Effect) -> tuple[bool, ...]:
    """Structure of play and shafts: where the encoder is, whether the rotor is divided."""
    if effect.effect not in native.SUFFIX:
        return ()
    return tuple(bool(value) for value in (effect.values()[1], *effect.values()[3:]))
