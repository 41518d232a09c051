"""Effects written into a compiled model in place; each means what `sim.effects.spec.ADDED` does to a spec."""

from collections.abc import Callable
from dataclasses import dataclass

import mujoco
import numpy as np

from bumblebee.diagnosis.simulation.declared import touching
from bumblebee.diagnosis.simulation.plant import Plant
from bumblebee.sim.effects import ADDED, STICTION_SOLIMP, STICTION_SOLREF, native


@dataclass(frozen=True, eq=False)
class Target:
    """Place in the model that one effect is written into."""

    plant: Plant
    model: mujoco.MjModel
    delay: np.ndarray
    offset: np.ndarray
    place: str

    @property
    def column(self) -> int:
        """Column of the joint."""
        return self.plant.joints.index(self.place)

    @property
    def dof(self) -> int:
        """The joint's."""
        return int(self.plant.dof[self.column])

    @property
    def joint(self) -> int:
        """Its id."""
        return int(self.model.dof_jntid[self.dof])

    @property
    def actuator(self) -> int:
        """The joint's; -1 for none."""
        return int(self.plant.actuator[self.column])

    @property
    def body(self) -> int:
        """Its id."""
        return int(self.model.body(self.place).id)


def _stick(at: Target, *values: float) -> None:
    """Dry friction that sticks, for friction that a hook writes, too."""
    at.model.dof_solref[at.dof], at.model.dof_solimp[at.dof, :2] = STICTION_SOLREF, STICTION_SOLIMP


def _dry(at: Target, value: float) -> None:
    _stick(at)
    at.model.dof_frictionloss[at.dof] = value


def _damping(at: Target, value: float) -> None:
    at.model.dof_damping[at.dof] = value


def _drag(at: Target, value: float) -> None:
    at.model.dof_dampingpoly[at.dof, 0] = value


def _armature(at: Target, value: float) -> None:
    at.model.dof_armature[at.dof] = value


def _delay(at: Target, value: float) -> None:
    at.delay[at.actuator] = value


def _offset(at: Target, value: float) -> None:
    model, a = at.model, at.actuator
    if a >= 0:
        model.actuator_biasprm[a, 0] = model.actuator_biasprm[a, 1] * value * model.actuator_gear[a, 0]
    at.offset[at.column] = value


def _limit(at: Target, value: float) -> None:
    model, a = at.model, at.actuator
    force = value * at.plant.condition.supply / abs(model.actuator_gear[a, 0])
    model.actuator_forcelimited[a], model.actuator_forcerange[a] = 1, (-force, force)


def _scale_gains(at: Target, kp: float, kd: float) -> None:
    at.model.actuator_gainprm[at.actuator, 0] *= kp
    at.model.actuator_biasprm[at.actuator, :3] *= [kp, kp, kd]


def _asymmetry(at: Target, value: float) -> None:
    stiffness, rest = at.model.jnt_stiffness[at.joint], at.model.qpos_spring[at.model.jnt_qposadr[at.joint]]
    _spring(at, stiffness, stiffness * rest - 0.5 * value)


def _spring(at: Target, stiffness: float, preload: float) -> None:
    stiffness, rest = native.spring_of(float(stiffness), float(preload))
    at.model.jnt_stiffness[at.joint], at.model.qpos_spring[at.model.jnt_qposadr[at.joint]] = stiffness, rest


def _hysteresis(at: Target, amplitude: float, width: float, dahl: float) -> None:
    if not dahl:
        at.model.jnt_stiffness[at.joint], at.model.jnt_springyield[at.joint] = amplitude / width, width


def _backlash(at: Target, gap: float, encoder: float) -> None:
    second = int(at.model.joint(at.place + native.SUFFIX["backlash"]).id)
    at.model.jnt_range[second] = (-0.5 * gap, 0.5 * gap)


def _elasticity(at: Target, stiffness: float, encoder: float, loss: float, share: float) -> None:
    second = int(at.model.joint(at.place + native.SUFFIX["series_elasticity"]).id)
    at.model.jnt_stiffness[second] = stiffness
    at.model.dof_damping[at.model.jnt_dofadr[second]] = loss * stiffness


def _mass(at: Target, mass: float, spread: float) -> None:
    model, body = at.model, at.body
    factor = mass / model.body_mass[body]
    model.body_inertia[body] = native.spread_inertia(model.body_inertia[body], factor, spread)
    model.body_mass[body] = mass


def _com(at: Target, *centre: float) -> None:
    at.model.body_ipos[at.body] = centre


def _inertia(at: Target, *moments: float) -> None:
    at.model.body_inertia[at.body] = native.physical_inertia(moments)


def _ground_friction(at: Target, value: float) -> None:
    ground, friction = int(at.model.geom(at.place).id), at.model.geom_friction
    others = touching(at.model, ground)
    friction[ground, 0] = value
    friction[others, 0] = np.minimum(value, friction[others, 0])


def _ground_compliance(at: Target, time: float) -> None:
    ground = int(at.model.geom(at.place).id)
    at.model.geom_solref[[ground, *touching(at.model, ground)], 0] = time


def _slope(at: Target, x: float, y: float, z: float) -> None:
    at.model.opt.gravity = native.sloped(at.model.opt.gravity, x, y, z)


def _surface(at: Target, height: float, x: float, y: float, z: float, friction: float) -> None:
    model = at.model
    point, plane = (int(model.geom(name).id) for name in native.contact_names(at.place))
    model.geom_pos[point], model.geom_pos[plane] = (x, y, z), (0.0, 0.0, height)
    pairs = np.flatnonzero((np.stack((model.pair_geom1, model.pair_geom2)) == point).any(axis=0))
    model.pair_friction[pairs, :2] = friction


WRITE: dict[str, Callable[..., None]] = {
    "coulomb_friction": _dry,
    "quadratic_friction": _drag,
    "viscous_friction": _damping,
    "stribeck_friction": _stick,
    "load_dependent_friction": _stick,
    "discovered": _stick,
    "armature": _armature,
    "asymmetric_friction": _asymmetry,
    "motor_strength": lambda at, value: _scale_gains(at, value, value),
    "kp": lambda at, value: _scale_gains(at, value, 1.0),
    "kd": lambda at, value: _scale_gains(at, 1.0, value),
    "torque_limit": _limit,
    "command_delay": _delay,
    "encoder_offset": _offset,
    "joint_spring": _spring,
    "hysteresis": _hysteresis,
    "backlash": _backlash,
    "series_elasticity": _elasticity,
    "link_mass": _mass,
    "link_com": _com,
    "link_inertia": _inertia,
    "ground_friction": _ground_friction,
    "ground_compliance": _ground_compliance,
    "ground_slope": _slope,
    "surface_contact": _surface,
}
"""Effect -> how it is written into a compiled model, (target, *parameters)."""
if unlike := WRITE.keys() ^ ADDED.keys():
    where = "bumblebee/diagnosis/simulation/in_place.py"
    raise TypeError(f"{where}: WRITE needs a row for what sim/effects/spec.py adds to a spec; not so: {sorted(unlike)}")
