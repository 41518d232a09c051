"""Effects as native MJCF: added to an editable spec, so that the corrected model loads in plain MuJoCo.

| effect | MJCF |
|---|---|
| coulomb_friction, viscous_friction, armature | joint frictionloss (stiff), damping, armature |
| motor_strength, kp, kd | the servo's gainprm and biasprm |
| command_delay | actuator delay, nsample, interp="linear": the mean of the held, delayed command over each step |
| encoder_offset | biasprm[0] = biasprm[1] * offset: the servo's part; the reading's part is a runtime hook |
| link_mass | body inertial mass; centre of mass and inertia stay as declared |
"""

import math
from collections.abc import Sequence
from typing import Any

import mujoco

from bumblebee.errors import BadInput
from bumblebee.sim.effect_catalogue import (
    CATALOGUE,
    STICTION_ITERATIONS,
    STICTION_SOLIMP,
    STICTION_SOLREF,
    Effect,
)

# The order matters: the encoder's offset is multiplied with the gain that is in force.
_ORDER = tuple(CATALOGUE)


def add_to_spec(spec: mujoco.MjSpec, effects: Sequence[Effect]) -> None:
    """Add every effect that MuJoCo can express to `spec`, in place."""
    for effect in sorted(effects, key=lambda e: _ORDER.index(e.effect)):
        for place in effect.where:
            _ADD[effect.effect](spec, place, effect.value())


def _joint(spec: mujoco.MjSpec, name: str) -> Any:
    joint = spec.joint(name)
    if joint is None:
        raise BadInput(f"effect on joint {name!r}", "a joint of the model", "no joint of this name")
    return joint


def _servos(spec: mujoco.MjSpec, joint: str) -> list[Any]:
    """Every actuator that drives `joint`."""
    _joint(spec, joint)
    kinds = (mujoco.mjtTrn.mjTRN_JOINT, mujoco.mjtTrn.mjTRN_JOINTINPARENT)
    servos = [a for a in spec.actuators if a.trntype in kinds and a.target == joint]
    if not servos:
        raise BadInput(f"effect on joint {joint!r}", "a joint with an actuator", "a passive joint")
    return servos


def _frictionloss(spec: mujoco.MjSpec, name: str, value: float) -> None:
    joint = _joint(spec, name)
    joint.frictionloss = value
    joint.solref_friction = STICTION_SOLREF
    joint.solimp_friction = [STICTION_SOLIMP, STICTION_SOLIMP, *joint.solimp_friction[2:]]
    spec.option.iterations = max(spec.option.iterations, STICTION_ITERATIONS)
    spec.option.ls_iterations = max(spec.option.ls_iterations, STICTION_ITERATIONS)


def _damping(spec: mujoco.MjSpec, name: str, value: float) -> None:
    joint = _joint(spec, name)
    joint.damping = [value, *joint.damping[1:]]


def _armature(spec: mujoco.MjSpec, name: str, value: float) -> None:
    _joint(spec, name).armature = value


def _scale_gains(spec: mujoco.MjSpec, name: str, kp: float, kd: float) -> None:
    for servo in _servos(spec, name):
        gain, bias = servo.gainprm.copy(), servo.biasprm.copy()
        gain[0] *= kp
        bias[:3] *= [kp, kp, kd]
        servo.gainprm, servo.biasprm = gain, bias


def _delay(spec: mujoco.MjSpec, name: str, value: float) -> None:
    for servo in _servos(spec, name):
        servo.delay = value
        servo.nsample = math.ceil(value / spec.option.timestep) + 2
        servo.interp = 1


def _offset(spec: mujoco.MjSpec, name: str, value: float) -> None:
    for servo in _servos(spec, name):
        bias = servo.biasprm.copy()
        bias[0] = bias[1] * value * servo.gear[0]
        servo.biasprm = bias


def _mass(spec: mujoco.MjSpec, name: str, value: float) -> None:
    body = spec.body(name)
    if body is None:
        raise BadInput(f"effect on body {name!r}", "a body of the model", "no body of this name")
    if not body.explicitinertial:
        declared = spec.compile()
        index = declared.body(name).id
        body.ipos, body.iquat = declared.body_ipos[index].copy(), declared.body_iquat[index].copy()
        body.inertia, body.explicitinertial = declared.body_inertia[index].copy(), True
    body.mass = value


_ADD = {
    "coulomb_friction": _frictionloss,
    "viscous_friction": _damping,
    "armature": _armature,
    "motor_strength": lambda spec, name, value: _scale_gains(spec, name, value, value),
    "kp": lambda spec, name, value: _scale_gains(spec, name, value, 1.0),
    "kd": lambda spec, name, value: _scale_gains(spec, name, 1.0, value),
    "command_delay": _delay,
    "encoder_offset": _offset,
    "link_mass": _mass,
}
