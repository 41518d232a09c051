"""The parts of effects that MJCF cannot carry, as arrays: what sensors report and what an engine adds to a step.

`sim.effects.forces` has the equations. Columns are the model's hinge and slide joints in the model's order, those of
play and flexible shafts left out.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import mujoco
import numpy as np

from bumblebee.errors import BadInput
from bumblebee.sim.effects.catalogue import CATALOGUE, Effect
from bumblebee.sim.effects.native import SUFFIX, is_hidden
from bumblebee.sim.effects.terms import Term, read_term


def _none() -> np.ndarray:
    return np.zeros(0)


@dataclass(frozen=True, eq=False)
class RuntimeHooks:
    """What an engine does beside MuJoCo; an array of zeros where an effect is absent."""

    joints: tuple[str, ...]
    """Names of the J joints."""
    encoder_offset: np.ndarray
    """(J,) [rad]: added to every reading of the joint's position (the servo's part is native)."""
    encoder_step: np.ndarray = field(default_factory=_none)
    """(J,) [rad]: the reading, and what the servo sees, is rounded to multiples of it; 0 for none."""
    encoder_delay: np.ndarray = field(default_factory=_none)
    """(J,) [s]: the servo's feedback, and the reading, is that old."""
    torque_lag: np.ndarray = field(default_factory=_none)
    """(J,) [s]: time constant of a first-order lag of the servo's torque."""
    dropped: np.ndarray = field(default_factory=_none)
    """(J,) share of commands that never arrive; the last one is held."""
    dropped_together: bool = True
    """Whether all joints lose the same commands."""
    stiction: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))
    """(J, 2): extra dry friction at rest [N m] and the speed [rad/s] at which it has gone."""
    load_friction: np.ndarray = field(default_factory=_none)
    """(J,) extra dry friction as a share of the servo's torque."""
    speed_limit: np.ndarray = field(default_factory=_none)
    """(J,) [rad/s]: no-load speed; infinite for none."""
    thermal: np.ndarray = field(default_factory=_none)
    """(J,) [1/s]: loss of strength a second at the torque limit."""
    drift: np.ndarray = field(default_factory=_none)
    """(J,) [1/s]: loss of strength a second."""
    cogging: tuple[tuple[int, float, float, float], ...] = ()
    """(joint, sine, cosine [N m], periods a turn)."""
    terms: tuple[tuple[int, float, Term], ...] = ()
    """(joint, coefficient, term) of discovered effects."""
    hysteresis: tuple[tuple[int, float, float], ...] = ()
    """(joint, amplitude [N m], width [rad]) of Dahl's law."""
    rotors: tuple[tuple[int, int], ...] = ()
    """(joint, address in qvel) of rotors behind play or shafts whose joints the encoders read."""
    wrench: tuple[tuple[int, np.ndarray], ...] = ()
    """(body id, (6,) force [N] and torque [N m] in the world, at the body's centre of mass)."""
    imu: np.ndarray = field(default_factory=lambda: np.zeros(3))
    """(3,) [rad]: rotation vector in the base's frame that is multiplied onto the reading of its orientation."""

    @property
    def empty(self) -> bool:
        """Whether the model alone carries every effect."""
        read = self.encoder_offset.any() or self.encoder_step.any() or self.imu.any()
        return not (read or self.dropped.any() or self.steps)

    @property
    def steps(self) -> bool:
        """Whether `effects.forces.StepHooks` has something to do."""
        return bool(self.each_step or self.wrench)

    @property
    def each_step(self) -> bool:
        """Whether something must be written before every physics step."""
        arrays = (self.encoder_step, self.encoder_delay, self.torque_lag, self.load_friction, self.thermal, self.drift)
        some = any(a.any() for a in arrays) or self.stiction[:, 0].any()
        some = some or np.isfinite(self.speed_limit).any() or self.hysteresis or self.rotors
        return bool(some or self.cogging or self.terms)


_COLUMN = {
    "encoder_offset": "encoder_offset",
    "encoder_quantisation": "encoder_step",
    "encoder_delay": "encoder_delay",
    "torque_lag": "torque_lag",
    "dropped_commands": "dropped",
    "load_dependent_friction": "load_friction",
    "torque_speed_limit": "speed_limit",
    "thermal_fade": "thermal",
    "strength_drift": "drift",
}


def hook_joints(model: mujoco.MjModel) -> list[int]:
    """Ids of the hinge and slide joints that have an encoder."""
    scalar = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))
    return [j for j in range(model.njnt) if int(model.jnt_type[j]) in scalar and not is_hidden(model.joint(j).name)]


def runtime_hooks(effects: Sequence[Effect], model: mujoco.MjModel) -> RuntimeHooks:
    """The hooks that `effects` need on `model`."""
    names = tuple(model.joint(j).name for j in hook_joints(model))
    table = {field_: np.zeros(len(names)) for field_ in _COLUMN.values()}
    table["speed_limit"] = np.full(len(names), np.inf)
    stiction, imu = np.zeros((len(names), 2)), np.zeros(3)
    stiction[:, 1] = 1.0
    cogging, wrench, terms, dahl, rotors, together = [], [], [], [], [], True
    for effect in effects:
        kind = CATALOGUE[effect.effect]
        if kind.on == "body" and effect.effect in ("imu_offset", "external_wrench"):
            bodies = [_body(model, effect.effect, place) for place in effect.where]
            if effect.effect == "imu_offset":
                imu[:2] = effect.values()
            else:
                wrench += [(body, np.array(effect.values())) for body in bodies]
            continue
        if effect.effect == "discovered":
            terms += _terms(names, effect)
        if effect.effect == "hysteresis" and effect.values()[-1]:
            dahl += [(_column(names, effect.effect, place), *effect.values()[:2]) for place in effect.where]
        if effect.effect in SUFFIX and effect.values()[1]:
            rotors += [(_column(names, effect.effect, p), _rotor(model, effect.effect, p)) for p in effect.where]
        if effect.effect not in (*_COLUMN, "stribeck_friction", "cogging"):
            continue
        together = together and not (effect.effect == "dropped_commands" and effect.where)
        for column in [_column(names, effect.effect, p) for p in effect.where] or range(len(names)):
            if effect.effect == "stribeck_friction":
                stiction[column] = effect.values()
            elif effect.effect == "cogging":
                sine, cosine, periods = effect.values()
                cogging.append((column, sine, cosine, periods))
            else:
                table[_COLUMN[effect.effect]][column] = effect.value()
    return RuntimeHooks(
        joints=names,
        stiction=stiction,
        cogging=tuple(cogging),
        terms=tuple(terms),
        hysteresis=tuple(dahl),
        rotors=tuple(rotors),
        wrench=tuple(wrench),
        imu=imu,
        dropped_together=together,
        **table,
    )


def _terms(names: tuple[str, ...], effect: Effect) -> list[tuple[int, float, Term]]:
    found = []
    for text, coefficient in effect.parameters.items():
        term = read_term(text)
        for other in term.others:
            _column(names, f"term {text!r}", other)
        found += [(_column(names, "discovered", place), coefficient, term) for place in effect.where]
    return found


def _column(names: tuple[str, ...], kind: str, place: str) -> int:
    if place not in names:
        raise BadInput(f"{kind} on joint {place!r}", "a hinge or slide of the model", "no such joint")
    return names.index(place)


def _rotor(model: mujoco.MjModel, kind: str, place: str) -> int:
    """Address in qvel of the hinge between a joint and its rotor."""
    joint = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, place + SUFFIX[kind])
    if joint < 0:
        raise BadInput(f"{kind} on joint {place!r}", f"a model with the joint {place + SUFFIX[kind]!r}", "none in it")
    return int(model.jnt_dofadr[joint])


def _body(model: mujoco.MjModel, kind: str, place: str) -> int:
    body = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, place)
    if body < 0:
        raise BadInput(f"{kind} on body {place!r}", "a body of the model", "no such body")
    return body
