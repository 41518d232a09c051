"""Play and flexible shafts in MJCF: a second hinge on the joint's axis, or, where the encoder reads the joint, a rotor.

With the encoder on the motor the joint's own hinge is the rotor's and the second one lies between it and the link. With
the encoder on the joint its hinge is the link's; the rotor is a weightless body behind a hinge of its own, its inertia
is that of a tendon along the sum of both angles, and `effects.forces` gives it the servo's torque. What of a rotor's
inertia turns with the link behind a shaft is the hinge's own in the one case and the tendon's in the other.
"""

import math
from typing import Any

import mujoco
import numpy as np

from bumblebee.effects import native
from bumblebee.effects.bare import bare_joint, bare_tendon
from bumblebee.errors import BadInput

_LEAST_GAP = 1e-9  # [rad]: MuJoCo takes no range of no width


def joint_of(spec: mujoco.MjSpec, name: str) -> Any:
    """The joint of this name; `BadInput` where there is none."""
    joint = spec.joint(name)
    if joint is None:
        raise BadInput(f"effect on joint {name!r}", "a joint of the model", "no joint of this name")
    return joint


def angle_of(spec: mujoco.MjSpec, joint: Any) -> float:
    """A radian in the unit that the spec counts this joint's angles in; 1 for slides."""
    hinge = joint.type == mujoco.mjtJoint.mjJNT_HINGE
    return math.degrees(1.0) if hinge and spec.compiler.degree else 1.0


def _second_hinge(spec: mujoco.MjSpec, name: str, kind: str, encoder: float) -> Any:
    """A joint on the same axis, the last of its body, or, with the encoder on the joint, a rotor's own.

    Keyframes get a zero for it.
    """
    joint, body = joint_of(spec, name), joint_of(spec, name).parent
    last = body.joints[-1].name
    if last not in (name, *(name + suffix for suffix in native.SUFFIX.values())):
        raise BadInput(f"{kind} on joint {name!r}", "the last joint of its body", f"joint {last!r} after it")
    rotors = {native.rotor_of(k, name) for k in native.SUFFIX}
    if rotors & {child.name for child in body.bodies} or (encoder and last != name):
        raise BadInput(f"{kind} on joint {name!r}", "one of play and shaft where the encoder is on the joint", "both")
    declared = spec.compile()
    at_q, at_v = _room_after(declared, declared.joint(last).id, bool(encoder))
    keys = [(np.insert(k.qpos, at_q, 0.0), np.insert(k.qvel, at_v, 0.0)) for k in _filled_keys(spec, declared)]
    if encoder:
        body = _rotor(joint, native.rotor_of(kind, name))
    hinge = bare_joint(body, name=name + native.SUFFIX[kind], type=joint.type, axis=joint.axis, pos=joint.pos)
    hinge.armature = native.HIDDEN_ARMATURE
    if encoder:
        _explicit(spec)
        hinge.armature, inertia = 0.0, max(float(joint.armature), native.HIDDEN_ARMATURE)
        joint.armature = 0.0
        _along_both(spec, body.name, name, hinge.name, inertia)
    for key, (qpos, qvel) in zip(spec.keys, keys, strict=True):
        key.qpos, key.qvel = qpos, qvel
    return hinge


def _explicit(spec: mujoco.MjSpec) -> None:
    """Actuators' torques as they are: MuJoCo's implicit integrators would damp the link but not the rotor.

    The servo's torque on the rotor is a hook's. An implicit step adds step * kd to the inertia of the joint that the
    actuator names, the link's, a third of that of a small arm's wrist at 1 ms.
    """
    if spec.option.integrator in (mujoco.mjtIntegrator.mjINT_IMPLICIT, mujoco.mjtIntegrator.mjINT_IMPLICITFAST):
        spec.option.integrator = mujoco.mjtIntegrator.mjINT_EULER


def _along_both(spec: mujoco.MjSpec, name: str, one: str, other: str, inertia: float) -> None:
    """Inertia [kg m^2] that turns by the sum of two joints' angles."""
    tendon = bare_tendon(spec, name=name, armature=inertia)
    tendon.wrap_joint(one, 1.0)
    tendon.wrap_joint(other, 1.0)


def _rotor(joint: Any, name: str) -> Any:
    """A next to weightless body on the joint's body, centred on the joint: what turns in it is the tendon's inertia."""
    body = joint.parent.add_body(name=name, mass=native.ROTOR_MASS, ipos=joint.pos, explicitinertial=True)
    body.inertia = [native.ROTOR_INERTIA] * 3
    return body


def _room_after(model: mujoco.MjModel, joint: int, below: bool) -> tuple[int, int]:
    """Where a joint after `joint` begins in qpos and qvel: on its body, or on a new last child of it (`below`)."""
    bodies = {int(model.jnt_bodyid[joint])}
    if below:
        for b in range(model.nbody):
            if int(model.body_parentid[b]) in bodies:
                bodies.add(b)
        joint = max(j for j in range(model.njnt) if int(model.jnt_bodyid[j]) in bodies)
    if joint + 1 == model.njnt:
        return model.nq, model.nv
    return int(model.jnt_qposadr[joint + 1]), int(model.jnt_dofadr[joint + 1])


def _filled_keys(spec: mujoco.MjSpec, declared: mujoco.MjModel) -> list[Any]:
    return [declared.key(i) for i in range(len(spec.keys))]


def add_backlash(spec: mujoco.MjSpec, name: str, gap: float, encoder: float) -> None:
    """Play of `gap` [rad] between motor and link; `encoder` 0: on the motor, 1: on the joint."""
    play = _second_hinge(spec, name, "backlash", encoder)
    half = 0.5 * max(gap, _LEAST_GAP) * angle_of(spec, play)
    play.range, play.limited = [-half, half], mujoco.mjtLimited.mjLIMITED_TRUE
    play.solref_limit = native.PLAY_SOLREF
    play.solimp_limit = [*native.PLAY_SOLIMP, *play.solimp_limit[3:]]


def add_elasticity(spec: mujoco.MjSpec, name: str, stiffness: float, encoder: float, loss: float, share: float) -> None:
    """A shaft of `stiffness` [N m/rad] between motor and link, damped by `loss` [s] times that.

    `encoder` 0: on the motor, 1: on the joint. The `share` of the joint's armature turns with the link.
    """
    armature = float(joint_of(spec, name).armature)
    flex = _second_hinge(spec, name, "series_elasticity", encoder)
    if encoder and share:
        spec.tendon(native.rotor_of("series_elasticity", name)).armature *= 1 - share
        joint_of(spec, name).armature = share * max(armature, native.HIDDEN_ARMATURE)
    elif share:
        joint_of(spec, name).armature = (1 - share) * armature
        _along_both(spec, native.rotor_of("series_elasticity", name), name, flex.name, share * armature)
    flex.stiffness = [stiffness, *flex.stiffness[1:]]
    flex.damping = [loss * stiffness, *flex.damping[1:]]
