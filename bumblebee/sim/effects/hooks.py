"""The parts of effects that MJCF cannot carry, as arrays: what sensors report and what an engine adds to a step.

`sim.effects.forces` has the equations. Columns are the model's hinge and slide joints in the model's order, those of
play and flexible shafts left out.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, fields
from typing import Any, Literal

import mujoco
import numpy as np

from bumblebee.errors import BadInput
from bumblebee.sim.effects.catalogue import CATALOGUE, HOOKED, Effect
from bumblebee.sim.effects.native import SUFFIX, is_hidden
from bumblebee.sim.effects.setpoints import NO_SPEED_LIMIT, SETPOINTS
from bumblebee.sim.effects.terms import Term, read_term

Acts = Literal["reading", "command", "start", "target", "gain", "loss", "limit", "feedback", "torque", "rotor", "terms"]
"""Places where a hook acts: what sensors report; which commands arrive; what is set once as a world begins; or, before
each physics step, the set-point of the servo, its gains, the dry friction, the torque's limit, the servo's feedback, a
torque beside it, its torque on a rotor. What discovered terms change, each says."""
_BEFORE_STEPS: tuple[Acts, ...] = ("target", "gain", "loss", "limit", "feedback", "torque", "rotor", "terms")


def _none() -> np.ndarray:
    return np.zeros(0)


@dataclass(frozen=True, eq=False)
class RuntimeHooks:
    """Hooks of an engine beside MuJoCo; an array of zeros where an effect is absent."""

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
    filter_time: np.ndarray = field(default_factory=_none)
    """(J,) [s]: time constant of a first-order lag of the target."""
    target_rate: np.ndarray = field(default_factory=_none)
    """(J,) [rad/s]: the fastest that the servo's set-point follows its target; infinite for none."""
    profile: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))
    """(J, 2): largest acceleration [rad/s^2], infinite for none, and speed [rad/s] of the set-point."""
    stiction: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))
    """(J, 2): extra dry friction at rest [N m] and the speed [rad/s] at which it has gone."""
    load_friction: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))
    """(J, 2): extra dry friction as a share of the servo's torque, and how much more of it forward than backward."""
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

    def has(self, *acts: Acts) -> bool:
        """Whether there is an effect that changes one of these."""
        return any(_is_there(self, name) for name, which in _ACTS.items() if which in acts)

    @property
    def empty(self) -> bool:
        """Whether the model alone carries every effect."""
        return not any(_is_there(self, name) for name in _ACTS)

    @property
    def only_offsets(self) -> bool:
        """Whether nothing but encoders' offsets is left to do, which every engine does by itself."""
        return not any(_is_there(self, name) for name in _ACTS if name != "encoder_offset")

    @property
    def steps(self) -> bool:
        """Whether `effects.forces.StepHooks` has something to do."""
        return self.each_step or self.has("start")

    @property
    def each_step(self) -> bool:
        """Whether something must be written before every physics step."""
        return self.has(*_BEFORE_STEPS)


_ACTS: dict[str, Acts] = {
    "encoder_offset": "reading",
    "encoder_step": "feedback",
    "encoder_delay": "feedback",
    "torque_lag": "feedback",
    "dropped": "command",
    "filter_time": "target",
    "target_rate": "target",
    "profile": "target",
    "stiction": "loss",
    "load_friction": "loss",
    "speed_limit": "limit",
    "thermal": "gain",
    "drift": "gain",
    "cogging": "torque",
    "terms": "terms",
    "hysteresis": "torque",
    "rotors": "rotor",
    "wrench": "start",
    "imu": "reading",
}
SETPOINT_ARRAYS = dict(zip(SETPOINTS, ("filter_time", "target_rate", "profile"), strict=True))
"""Effect on the set-point -> its array."""
_FIELDS = [f.name for f in fields(RuntimeHooks) if f.name not in ("joints", "dropped_together")]
if unsaid := set(_FIELDS) ^ _ACTS.keys():
    raise TypeError(
        f"bumblebee/sim/effects/hooks.py: _ACTS needs a row for each array of RuntimeHooks; not so: {unsaid}"
    )
_ABSENT = {
    "speed_limit": np.inf,
    "target_rate": np.inf,
    "profile": np.inf,
}  # where an effect is not there; the others at 0
_LISTS = [f.name for f in fields(RuntimeHooks) if f.default == ()]


_SHAPED = ("stiction", "profile")  # the second number shapes the first, which is none where the effect is absent


def _is_there(hooks: RuntimeHooks, name: str) -> bool:
    value = getattr(hooks, name)
    if isinstance(value, tuple):
        return bool(value)
    first = value[:, 0] if name in _SHAPED else value
    return bool((first != _ABSENT.get(name, 0.0)).any())


def hook_joints(model: mujoco.MjModel) -> list[int]:
    """Ids of the hinge and slide joints that have an encoder."""
    scalar = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))
    return [j for j in range(model.njnt) if int(model.jnt_type[j]) in scalar and not is_hidden(model.joint(j).name)]


class _Making:
    """The hooks of one model while they are made; attributes are those of `RuntimeHooks`."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self.model = model
        self.joints = tuple(model.joint(j).name for j in hook_joints(model))
        count = len(self.joints)
        arrays = {name: np.full(count, _ABSENT.get(name, 0.0)) for name in _ACTS if name not in _LISTS}
        self.made: dict[str, Any] = arrays | dict.fromkeys(_LISTS, ())
        self.made |= {"imu": np.zeros(3), "dropped_together": True, "stiction": np.tile((0.0, 1.0), (count, 1))}
        self.made["load_friction"] = np.zeros((count, 2))
        self.made["profile"] = np.tile((np.inf, NO_SPEED_LIMIT), (count, 1))

    def column(self, kind: str, place: str) -> int:
        """Column of the joint `place`."""
        return _column(self.joints, kind, place)

    def columns(self, effect: Effect) -> Sequence[int]:
        """Columns of the joints that an effect sits on."""
        return [self.column(effect.effect, place) for place in effect.where] or range(len(self.joints))


def _array(name: str) -> Callable[[_Making, Effect], None]:
    def hook(making: _Making, effect: Effect) -> None:
        for column in making.columns(effect):
            making.made[name][column] = effect.value()

    return hook


def _dropped(making: _Making, effect: Effect) -> None:
    making.made["dropped_together"] &= not effect.where
    _array("dropped")(making, effect)


def _setpoint(name: str) -> Callable[[_Making, Effect], None]:
    def hook(making: _Making, effect: Effect) -> None:
        others = [making.made[other] for other in SETPOINT_ARRAYS.values() if other != name]
        for column in making.columns(effect):
            if any(np.isfinite(np.ravel(array[column])[0]) and np.ravel(array[column])[0] for array in others):
                joint = making.joints[column]
                raise BadInput(f"{effect.effect} on joint {joint!r}", f"one of {', '.join(SETPOINTS)}", "two")
            making.made[name][column] = effect.values() if making.made[name].ndim == 2 else effect.value()

    return hook


def _rows(name: str) -> Callable[[_Making, Effect], None]:
    def hook(making: _Making, effect: Effect) -> None:
        for column in making.columns(effect):
            making.made[name][column] = effect.values()

    return hook


def _cogging(making: _Making, effect: Effect) -> None:
    making.made["cogging"] += tuple((column, *effect.values()) for column in making.columns(effect))


def _dahl(making: _Making, effect: Effect) -> None:
    amplitude, width, dahl = effect.values()
    if dahl:
        columns = [making.column(effect.effect, place) for place in effect.where]
        making.made["hysteresis"] += tuple((column, amplitude, width) for column in columns)


def _rotors(making: _Making, effect: Effect) -> None:
    if effect.values()[1]:
        making.made["rotors"] += tuple(
            (making.column(effect.effect, p), _rotor(making.model, effect.effect, p)) for p in effect.where
        )


def _discovered(making: _Making, effect: Effect) -> None:
    making.made["terms"] += tuple(_terms(making.joints, effect))


def _tilt(making: _Making, effect: Effect) -> None:
    for place in effect.where:
        _body(making.model, effect.effect, place)
    making.made["imu"][:2] = effect.values()


def _wrench(making: _Making, effect: Effect) -> None:
    bodies = [_body(making.model, effect.effect, place) for place in effect.where]
    making.made["wrench"] += tuple((body, np.array(effect.values())) for body in bodies)


HOOKS: dict[str, Callable[[_Making, Effect], None]] = {
    "encoder_offset": _array("encoder_offset"),
    "encoder_quantisation": _array("encoder_step"),
    "encoder_delay": _array("encoder_delay"),
    "torque_lag": _array("torque_lag"),
    "dropped_commands": _dropped,
    **{kind: _setpoint(name) for kind, name in SETPOINT_ARRAYS.items()},
    "stribeck_friction": _rows("stiction"),
    "load_dependent_friction": _rows("load_friction"),
    "torque_speed_limit": _array("speed_limit"),
    "thermal_fade": _array("thermal"),
    "strength_drift": _array("drift"),
    "cogging": _cogging,
    "hysteresis": _dahl,
    "backlash": _rotors,
    "series_elasticity": _rotors,
    "imu_offset": _tilt,
    "external_wrench": _wrench,
    "discovered": _discovered,
}
"""Effect -> what it adds to the hooks, of those that plain MJCF does not carry in every form."""
_NEEDED = {kind for kind, entry in CATALOGUE.items() if not entry.native} | HOOKED.keys()
if unlike := _NEEDED ^ HOOKS.keys():
    raise TypeError(
        f"bumblebee/sim/effects/hooks.py: HOOKS needs a row each for what MJCF lacks; not so: {sorted(unlike)}"
    )


def runtime_hooks(effects: Sequence[Effect], model: mujoco.MjModel) -> RuntimeHooks:
    """The hooks that `effects` need on `model`."""
    making = _Making(model)
    for effect in effects:
        if effect.effect in HOOKS:
            HOOKS[effect.effect](making, effect)
    return RuntimeHooks(making.joints, **making.made)


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
