"""Effects as native MJCF: added to an editable spec, so that the corrected model loads in plain MuJoCo.

| effect | MJCF |
|---|---|
| coulomb_friction, viscous_friction, armature | joint frictionloss (stiff), damping, armature |
| quadratic_friction | the second coefficient of the joint's damping, -c v abs(v) |
| asymmetric_friction | a constant torque, as a weak spring with a far reference, beside the dry friction |
| motor_strength, kp, kd | the servo's gainprm and biasprm |
| torque_limit | the servo's forcerange |
| command_delay | actuator delay, nsample, interp="linear": the mean of the held, delayed command over each step |
| encoder_offset | biasprm[0] = biasprm[1] * offset: a servo's part; the reading's part is a runtime hook |
| joint_spring, hysteresis | joint stiffness with springref; with springyield |
| backlash, series_elasticity | a second hinge on the same axis, with a range; with a stiffness. nq grows |
| the same, encoder on the joint | a rotor of its own: a weightless body on such a hinge, whose inertia is a tendon's |
| link_mass, link_com, link_inertia | the body's inertial; the moments with the mass where `spread` says so |
| ground_friction, ground_compliance | friction, solref of the geometry and of what can touch it |
| ground_slope | gravity |
| surface_contact | a sphere of 1 mm on the body, a plane of the world, and a contact pair of these two |

The others need `sim.effects.hooks` at run time.
"""

from collections.abc import Callable, Sequence
from typing import Any

import mujoco
import numpy as np

from bumblebee.errors import BadInput
from bumblebee.robot.drives import ON_JOINT, buffer_length
from bumblebee.sim.effects import native
from bumblebee.sim.effects.catalogue import CATALOGUE, STICTION_ITERATIONS, STICTION_SOLIMP, STICTION_SOLREF, Effect
from bumblebee.sim.effects.hinges import add_backlash, add_elasticity, angle_of, joint_of

# The order matters: the encoder's offset is multiplied with the gain that is in force.
_ORDER = tuple(CATALOGUE)
_ROLLING = (0.005, 1e-4, 1e-4)  # MuJoCo's own, which a contact of three dimensions does not ask


def add_to_spec(spec: mujoco.MjSpec, effects: Sequence[Effect]) -> None:
    """Add every effect that MuJoCo can express to `spec`, in place."""
    for effect in sorted(effects, key=lambda e: _ORDER.index(e.effect)):
        if effect.effect not in ADDED:
            continue
        for place in effect.where or _everywhere(spec, effect.effect):
            ADDED[effect.effect](spec, place, *effect.values())


def _everywhere(spec: mujoco.MjSpec, kind: str) -> tuple[str, ...]:
    """The places that `where: []` stands for."""
    if not CATALOGUE[kind].whole:
        return ("",)
    return tuple(dict.fromkeys(a.target for a in spec.actuators if a.trntype in ON_JOINT))


def _drives(spec: mujoco.MjSpec, joint: str) -> list[Any]:
    """Every actuator that drives `joint`; none for a passive one."""
    joint_of(spec, joint)
    return [a for a in spec.actuators if a.trntype in ON_JOINT and a.target == joint]


def _servos(spec: mujoco.MjSpec, joint: str) -> list[Any]:
    """Servos of a joint that must have one."""
    servos = _drives(spec, joint)
    if not servos:
        raise BadInput(f"effect on joint {joint!r}", "a joint with an actuator", "a passive joint")
    return servos


def _frictionloss(spec: mujoco.MjSpec, name: str, value: float) -> None:
    _stiff_friction(spec, name)
    joint_of(spec, name).frictionloss = value


def _stiff_friction(spec: mujoco.MjSpec, name: str, *values: float) -> None:
    """Dry friction that sticks, for friction that a hook writes at run time, too."""
    joint = joint_of(spec, name)
    joint.solref_friction = STICTION_SOLREF
    joint.solimp_friction = [STICTION_SOLIMP, STICTION_SOLIMP, *joint.solimp_friction[2:]]
    spec.option.iterations = max(spec.option.iterations, STICTION_ITERATIONS)
    spec.option.ls_iterations = max(spec.option.ls_iterations, STICTION_ITERATIONS)


def _damping(spec: mujoco.MjSpec, name: str, value: float) -> None:
    joint = joint_of(spec, name)
    joint.damping = [value, *joint.damping[1:]]


def _drag(spec: mujoco.MjSpec, name: str, value: float) -> None:
    joint = joint_of(spec, name)
    joint.damping = [joint.damping[0], value, joint.damping[2]]


def _armature(spec: mujoco.MjSpec, name: str, value: float) -> None:
    joint_of(spec, name).armature = value


def _set_spring(spec: mujoco.MjSpec, joint: Any, stiffness: float, preload: float) -> None:
    stiffness, reference = native.spring_of(stiffness, preload)
    joint.stiffness = [stiffness, *joint.stiffness[1:]]
    joint.springref = reference * angle_of(spec, joint)


def _asymmetry(spec: mujoco.MjSpec, name: str, difference: float) -> None:
    joint = joint_of(spec, name)
    stiffness = float(joint.stiffness[0])
    preload = stiffness * joint.springref / angle_of(spec, joint)
    _set_spring(spec, joint, stiffness, preload - 0.5 * difference)


def _spring(spec: mujoco.MjSpec, name: str, stiffness: float, preload: float) -> None:
    _set_spring(spec, joint_of(spec, name), stiffness, preload)


def _hysteresis(spec: mujoco.MjSpec, name: str, amplitude: float, width: float, dahl: float) -> None:
    joint = joint_of(spec, name)
    if dahl:  # a hook
        return
    if joint.stiffness[0]:
        raise BadInput(f"hysteresis on joint {name!r}", "a joint without a spring", "one with a stiffness")
    joint.stiffness = [amplitude / width, *joint.stiffness[1:]]
    joint.springyield = width * angle_of(spec, joint)


def _scale_gains(spec: mujoco.MjSpec, name: str, kp: float, kd: float) -> None:
    for servo in _servos(spec, name):
        gain, bias = servo.gainprm.copy(), servo.biasprm.copy()
        gain[0] *= kp
        bias[:3] *= [kp, kp, kd]
        servo.gainprm, servo.biasprm = gain, bias


def _limit(spec: mujoco.MjSpec, name: str, limit: float) -> None:
    for servo in _servos(spec, name):
        force = limit / abs(servo.gear[0])
        servo.forcerange, servo.forcelimited = [-force, force], mujoco.mjtLimited.mjLIMITED_TRUE


def _delay(spec: mujoco.MjSpec, name: str, value: float) -> None:
    for servo in _servos(spec, name):
        servo.delay = value
        servo.nsample = buffer_length(value, spec.option.timestep)
        servo.interp = 1


def _offset(spec: mujoco.MjSpec, name: str, value: float) -> None:
    for servo in _drives(spec, name):  # the encoder of a passive joint moves nothing
        bias = servo.biasprm.copy()
        bias[0] = bias[1] * value * servo.gear[0]
        servo.biasprm = bias


def _body(spec: mujoco.MjSpec, name: str) -> Any:
    """A body whose mass, centre and principal moments stand in the spec itself."""
    body = spec.body(name)
    if body is None:
        raise BadInput(f"effect on body {name!r}", "a body of the model", "no body of this name")
    if not body.explicitinertial or np.isfinite(body.fullinertia[0]):
        declared = spec.compile()
        index = declared.body(name).id
        body.mass = declared.body_mass[index]
        body.ipos, body.iquat = declared.body_ipos[index].copy(), declared.body_iquat[index].copy()
        body.fullinertia = np.full(6, np.nan)
        body.inertia, body.explicitinertial = declared.body_inertia[index].copy(), True
    return body


def _mass(spec: mujoco.MjSpec, name: str, value: float, spread: float) -> None:
    body = _body(spec, name)
    if spread:
        body.inertia = native.spread_inertia(body.inertia, value / body.mass, spread)
    body.mass = value


def _com(spec: mujoco.MjSpec, name: str, *centre: float) -> None:
    _body(spec, name).ipos = centre


def _inertia(spec: mujoco.MjSpec, name: str, *moments: float) -> None:
    _body(spec, name).inertia = native.physical_inertia(moments)


def _ground(spec: mujoco.MjSpec, name: str) -> tuple[Any, list[Any]]:
    """The geometry and all that can touch it."""
    ground = next((g for g in spec.geoms if g.name == name), None)
    if ground is None:
        raise BadInput(f"effect on geom {name!r}", "a geometry of the model", "no geometry of this name")
    masks = (ground.contype, ground.conaffinity)
    others = [g for g in spec.geoms if g is not ground and native.touch(*masks, g.contype, g.conaffinity)]
    return ground, others


def _ground_friction(spec: mujoco.MjSpec, name: str, value: float) -> None:
    ground, others = _ground(spec, name)
    ground.friction = [value, *ground.friction[1:]]
    for geom in others:  # of two geometries the larger friction counts
        geom.friction = [min(value, geom.friction[0]), *geom.friction[1:]]


def _ground_compliance(spec: mujoco.MjSpec, name: str, time: float) -> None:
    ground, others = _ground(spec, name)
    for geom in (ground, *others):
        geom.solref = [time, *geom.solref[1:]]


def _slope(spec: mujoco.MjSpec, name: str, x: float, y: float, z: float) -> None:
    spec.option.gravity = native.sloped(spec.option.gravity, x, y, z)


def _surface(spec: mujoco.MjSpec, name: str, height: float, x: float, y: float, z: float, friction: float) -> None:
    """A point of the body and a level plane, which touch each other and nothing else."""
    body = spec.body(name)
    if body is None:
        raise BadInput(f"effect on body {name!r}", "a body of the model", "no body of this name")
    point, plane = native.contact_names(name)
    silent: dict[str, Any] = {"contype": 0, "conaffinity": 0}
    size, place = [native.POINT_RADIUS, 0, 0], [x, y, z]
    body.add_geom(name=point, type=mujoco.mjtGeom.mjGEOM_SPHERE, size=size, pos=place, mass=0, **silent)
    flat = {"type": mujoco.mjtGeom.mjGEOM_PLANE, "size": [0, 0, 1], "pos": [0, 0, height]}
    spec.worldbody.add_geom(name=plane, **flat, **silent)
    sliding = [friction, friction, *_ROLLING]
    spec.add_pair(geomname1=point, geomname2=plane, condim=3, friction=sliding)


ADDED: dict[str, Callable[..., None]] = {
    "coulomb_friction": _frictionloss,
    "viscous_friction": _damping,
    "quadratic_friction": _drag,
    "stribeck_friction": _stiff_friction,
    "load_dependent_friction": _stiff_friction,
    "discovered": _stiff_friction,
    "armature": _armature,
    "asymmetric_friction": _asymmetry,
    "motor_strength": lambda spec, name, value: _scale_gains(spec, name, value, value),
    "kp": lambda spec, name, value: _scale_gains(spec, name, value, 1.0),
    "kd": lambda spec, name, value: _scale_gains(spec, name, 1.0, value),
    "torque_limit": _limit,
    "command_delay": _delay,
    "encoder_offset": _offset,
    "joint_spring": _spring,
    "hysteresis": _hysteresis,
    "backlash": add_backlash,
    "series_elasticity": add_elasticity,
    "link_mass": _mass,
    "link_com": _com,
    "link_inertia": _inertia,
    "ground_friction": _ground_friction,
    "ground_compliance": _ground_compliance,
    "ground_slope": _slope,
    "surface_contact": _surface,
}
"""Effect -> what it changes in a spec, (spec, place, *parameters)."""
if missing := {kind for kind, entry in CATALOGUE.items() if entry.native} - ADDED.keys():
    raise TypeError(f"bumblebee/sim/effects/spec.py: ADDED needs a row for what plain MJCF carries: {sorted(missing)}")
if unknown := ADDED.keys() - CATALOGUE.keys():
    raise TypeError(f"bumblebee/sim/effects/spec.py: ADDED has what the catalogue does not: {sorted(unknown)}")
