"""Places in an editable spec, for effects that MJCF carries."""

from typing import Any

import mujoco
import numpy as np

from bumblebee.effects import native
from bumblebee.effects.hinges import angle_of, joint_of
from bumblebee.effects.places import Spot
from bumblebee.errors import BadInput
from bumblebee.robot.drives import ON_JOINT

# MuJoCo's default dry friction creeps where a real joint sticks; a joint with `coulomb_friction` gets it stiff.
STICTION_SOLREF = (0.004, 1.0)
STICTION_SOLIMP = 0.99
# The solver needs this many iterations to hold several stuck joints and contacts at once.
STICTION_ITERATIONS = 20
_FROM_GEOMETRIES, _WHERE_NONE_IS_STATED = 1, 2  # of `inertiafromgeom`


def drives_of(spec: mujoco.MjSpec, joint: str) -> list[Any]:
    """Every actuator that drives `joint`; none for a passive one."""
    joint_of(spec, joint)
    return [a for a in spec.actuators if a.trntype in ON_JOINT and a.target == joint]


def servos_of(spec: mujoco.MjSpec, joint: str) -> list[Any]:
    """Servos of a joint that must have one."""
    servos = drives_of(spec, joint)
    if not servos:
        raise BadInput(f"effect on joint {joint!r}", "a joint with an actuator", "a passive joint")
    return servos


def scale_gains(spec: mujoco.MjSpec, joint: str, kp: float, kd: float) -> None:
    """Multiply a servo's gains."""
    for servo in servos_of(spec, joint):
        gain, bias = servo.gainprm.copy(), servo.biasprm.copy()
        gain[0] *= kp
        bias[:3] *= [kp, kp, kd]
        servo.gainprm, servo.biasprm = gain, bias


def scale_gains_in_place(spot: Spot, kp: float, kd: float) -> None:
    """`scale_gains` of a compiled model."""
    model = spot.model
    servos = np.isin(model.actuator_trntype, ON_JOINT) & (model.actuator_trnid[:, 0] == spot.joint)
    model.actuator_gainprm[servos, 0] *= kp
    model.actuator_biasprm[servos, :3] *= [kp, kp, kd]


def stick(spec: mujoco.MjSpec, name: str) -> None:
    """Dry friction that sticks, for friction that a hook writes at run time, too."""
    joint = joint_of(spec, name)
    joint.solref_friction = STICTION_SOLREF
    joint.solimp_friction = [STICTION_SOLIMP, STICTION_SOLIMP, *joint.solimp_friction[2:]]
    spec.option.iterations = max(spec.option.iterations, STICTION_ITERATIONS)
    spec.option.ls_iterations = max(spec.option.ls_iterations, STICTION_ITERATIONS)


def stick_in_place(spot: Spot) -> None:
    """`stick` of a compiled model."""
    spot.model.dof_solref[spot.dof], spot.model.dof_solimp[spot.dof, :2] = STICTION_SOLREF, STICTION_SOLIMP


def set_spring(spec: mujoco.MjSpec, joint: Any, stiffness: float, preload: float) -> None:
    """Give a joint the torque -stiffness q + preload."""
    stiffness, reference = native.spring_of(stiffness, preload)
    joint.stiffness = [stiffness, *joint.stiffness[1:]]
    joint.springref = reference * angle_of(spec, joint)


def set_spring_in_place(spot: Spot, stiffness: float, preload: float) -> None:
    """`set_spring` of a compiled model."""
    stiffness, rest = native.spring_of(float(stiffness), float(preload))
    spot.model.jnt_stiffness[spot.joint], spot.model.qpos_spring[spot.model.jnt_qposadr[spot.joint]] = stiffness, rest


def body_of(spec: mujoco.MjSpec, name: str) -> Any:
    """A body whose mass, centre and principal moments stand in the spec itself."""
    body = spec.body(name)
    if body is None:
        raise BadInput(f"effect on body {name!r}", "a body of the model", "no body of this name")
    if spec.compiler.inertiafromgeom == _FROM_GEOMETRIES or spec.compiler.settotalmass > 0:
        declared = spec.compile()
        for other in spec.bodies[1:]:
            _state_inertia(other, declared)
        spec.compiler.inertiafromgeom, spec.compiler.settotalmass = _WHERE_NONE_IS_STATED, -1
    elif not body.explicitinertial or np.isfinite(body.fullinertia[0]):
        _state_inertia(body, spec.compile())
    return body


def _state_inertia(body: Any, declared: mujoco.MjModel) -> None:
    """Write the compiled mass, centre and principal moments of a body into it."""
    index = declared.body(body.name).id if body.name else body.id
    body.mass = declared.body_mass[index]
    body.ipos, body.iquat = declared.body_ipos[index].copy(), declared.body_iquat[index].copy()
    body.fullinertia = np.full(6, np.nan)
    body.inertia, body.explicitinertial = declared.body_inertia[index].copy(), True


def ground_of(spec: mujoco.MjSpec, name: str) -> tuple[Any, list[Any]]:
    """The geometry and all that can touch it."""
    ground = next((g for g in spec.geoms if g.name == name), None)
    if ground is None:
        raise BadInput(f"effect on geom {name!r}", "a geometry of the model", "no geometry of this name")
    masks = (ground.contype, ground.conaffinity)
    others = [g for g in spec.geoms if g is not ground and native.touch(*masks, g.contype, g.conaffinity)]
    return ground, others


def pairs_of(spec: mujoco.MjSpec, ground: str) -> list[Any]:
    """Contact pairs that the model names of a geometry."""
    return [pair for pair in spec.pairs if ground in (pair.geomname1, pair.geomname2)]
