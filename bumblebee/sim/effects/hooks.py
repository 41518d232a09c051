"""The parts of effects that MJCF cannot carry, as arrays: what sensors report and what an engine adds to a step.

`sim.effects.forces` has the equations. Columns are the model's hinge and slide joints in the model's order, those of
play and flexible shafts left out.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, fields
from typing import Any, Literal

import mujoco
import numpy as np

from bumblebee.effects.catalogue import CATALOGUE, Effect
from bumblebee.effects.kind import Kind
from bumblebee.effects.native import SUFFIX, is_hidden
from bumblebee.effects.setpoints import NO_SPEED_LIMIT, SETPOINTS
from bumblebee.effects.terms import Term, read_term
from bumblebee.errors import BadInput

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
    laws: tuple[tuple[int, str, tuple[float, ...]], ...] = ()
    """(joint, effect, its parameters) of torques that follow from a joint's state, `effects.kind.Kind.torque_at`."""
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
    "laws": "torque",
    "terms": "terms",
    "hysteresis": "torque",
    "rotors": "rotor",
    "wrench": "start",
    "imu": "reading",
}
SETPOINT_ARRAYS = ("filter_time", "target_rate", "profile")
"""Arrays of what drives make of their targets."""
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


class Making:
    """The hooks of one model while effects put theirs in; attributes are those of `RuntimeHooks`."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self.model = model
        self.joints = tuple(model.joint(j).name for j in hook_joints(model))
        count = len(self.joints)
        arrays = {name: np.full(count, _ABSENT.get(name, 0.0)) for name in _ACTS if name not in _LISTS}
        self.made: dict[str, Any] = arrays | dict.fromkeys(_LISTS, ())
        self.made |= {"imu": np.zeros(3), "dropped_together": True, "stiction": np.tile((0.0, 1.0), (count, 1))}
        self.made["load_friction"] = np.zeros((count, 2))
        self.made["profile"] = np.tile((np.inf, NO_SPEED_LIMIT), (count, 1))

    def columns(self, effect: Effect) -> Sequence[int]:
        """Columns of the joints that an effect sits on."""
        return [self._column(effect.effect, place) for place in effect.where] or range(len(self.joints))

    def bodies(self, effect: Effect) -> list[int]:
        """Ids of the bodies that an effect sits on."""
        return [self._body(effect.effect, place) for place in effect.where]

    def first(self, name: str, effect: Effect) -> None:
        """Write the first parameter into an array (J,)."""
        self.made[name][self.columns(effect)] = effect.value()

    def rows(self, name: str, effect: Effect) -> None:
        """Write all parameters into an array (J, P)."""
        self.made[name][self.columns(effect)] = effect.values()

    def append(self, name: str, rows: Iterable[tuple[Any, ...]]) -> None:
        """Add rows to a list."""
        self.made[name] += tuple(rows)

    def laws(self, kind: Kind, effect: Effect) -> None:
        """Add a torque that `Kind.torque_at` gives."""
        self.append("laws", ((column, kind.id, effect.values()) for column in self.columns(effect)))

    def drop(self, effect: Effect) -> None:
        """Lose commands: of all joints the same ones, if no effect names a joint."""
        self.made["dropped_together"] &= not effect.where
        self.first("dropped", effect)

    def setpoint(self, name: str, effect: Effect) -> None:
        """Write the parameters of what a drive makes of its targets; a drive does one thing with them."""
        others = [self.made[other] for other in SETPOINT_ARRAYS if other != name]
        for column in self.columns(effect):
            if any(np.isfinite(np.ravel(array[column])[0]) and np.ravel(array[column])[0] for array in others):
                joint = self.joints[column]
                raise BadInput(f"{effect.effect} on joint {joint!r}", f"one of {', '.join(SETPOINTS)}", "two")
            self.made[name][column] = effect.values() if self.made[name].ndim == 2 else effect.value()

    def rotors(self, kind: str, effect: Effect) -> None:
        """Add rotors whose joints the encoders read."""
        self.append("rotors", ((self._column(kind, p), self._rotor(kind, p)) for p in effect.where))

    def terms(self, effect: Effect) -> None:
        """Add the terms of a discovered effect."""
        for text, coefficient in effect.parameters.items():
            term = read_term(text)
            for other in term.others:
                self._column(f"term {text!r}", other)
            self.append("terms", ((column, coefficient, term) for column in self.columns(effect)))

    def tilt(self, effect: Effect) -> None:
        """Turn the base's sensor."""
        self.bodies(effect)
        self.made["imu"][:2] = effect.values()

    def _column(self, kind: str, place: str) -> int:
        if place not in self.joints:
            raise BadInput(f"{kind} on joint {place!r}", "a hinge or slide of the model", "no such joint")
        return self.joints.index(place)

    def _rotor(self, kind: str, place: str) -> int:
        """Address in qvel of the hinge between a joint and its rotor."""
        joint = mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_JOINT, place + SUFFIX[kind])
        if joint < 0:
            came = "none in it"
            raise BadInput(f"{kind} on joint {place!r}", f"a model with the joint {place + SUFFIX[kind]!r}", came)
        return int(self.model.jnt_dofadr[joint])

    def _body(self, kind: str, place: str) -> int:
        body = mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_BODY, place)
        if body < 0:
            raise BadInput(f"{kind} on body {place!r}", "a body of the model", "no such body")
        return body


def runtime_hooks(effects: Sequence[Effect], model: mujoco.MjModel) -> RuntimeHooks:
    """The hooks that `effects` need on `model`."""
    making = Making(model)
    for effect in effects:
        if CATALOGUE[effect.effect].hooks:
            CATALOGUE[effect.effect].hook(making, effect)
    return RuntimeHooks(making.joints, **making.made)
