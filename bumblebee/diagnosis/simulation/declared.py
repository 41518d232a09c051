"""Declared values of an effect's parameters in a place."""

from collections.abc import Callable, Sequence

import mujoco
import numpy as np

from bumblebee.diagnosis.simulation.plant import Plant
from bumblebee.sim.effects import CATALOGUE, NO_SPEED_LIMIT, native


def touching(model: mujoco.MjModel, ground: int) -> list[int]:
    """Geometries that the geometry `ground` can touch."""
    types, affinities = model.geom_contype, model.geom_conaffinity
    pairs = ((g, native.touch(types[ground], affinities[ground], types[g], affinities[g])) for g in range(model.ngeom))
    return [g for g, meet in pairs if meet and g != ground]


def declared_values(plant: Plant, kind: str, place: str) -> tuple[float, ...]:
    """The parameters of an effect as the declared model has them; infinite where it knows no bound."""
    entry = CATALOGUE[kind]
    if not place and entry.on == "joint":
        return (0.0,) * len(entry.parameters)
    found = _DECLARED[kind](plant, place)
    return (*map(float, found), *(0.0,) * (len(entry.parameters) - len(found)))


_Declared = Callable[[Plant, str], Sequence[float] | np.ndarray]
"""(plant, place) -> the first parameters; the others are 0."""


def _absent_at(value: float) -> _Declared:
    """No model declares it: the value at which it is not there."""
    return lambda plant, place: (value,)


def _of_dof(name: str) -> _Declared:
    return lambda plant, place: (getattr(plant.model, name)[plant.dof[plant.joints.index(place)]],)


def _of_body(name: str) -> _Declared:
    return lambda plant, place: np.atleast_1d(getattr(plant.model, name)[plant.model.body(place).id])


def _delay(plant: Plant, place: str) -> Sequence[float]:
    a = plant.actuator[plant.joints.index(place)]
    return (plant.delay[a] if a >= 0 else 0.0,)


def _limit(plant: Plant, place: str) -> Sequence[float]:
    model, a = plant.model, plant.actuator[plant.joints.index(place)]
    limited = a >= 0 and model.actuator_forcelimited[a]
    given = abs(model.actuator_gear[a, 0]) * model.actuator_forcerange[a, 1] if limited else np.inf
    return (given / plant.condition.supply,)


def _spring(plant: Plant, place: str) -> Sequence[float]:
    model, joint = plant.model, int(plant.model.joint(place).id)
    stiffness = float(model.jnt_stiffness[joint])
    return (stiffness, stiffness * float(model.qpos_spring[model.jnt_qposadr[joint]]))


def _ground_friction(plant: Plant, place: str) -> Sequence[float]:
    model, ground = plant.model, int(plant.model.geom(place).id)
    others = [model.geom_friction[g, 0] for g in touching(model, ground)]
    return (max(model.geom_friction[ground, 0], np.median(others) if others else 0.0),)


_NONE, _FACTOR, _UNBOUNDED = _absent_at(0.0), _absent_at(1.0), _absent_at(np.inf)
_DECLARED: dict[str, _Declared] = {
    "coulomb_friction": _of_dof("dof_frictionloss"),
    "viscous_friction": _of_dof("dof_damping"),
    "quadratic_friction": lambda plant, place: (plant.model.dof_dampingpoly[plant.dof[plant.joints.index(place)], 0],),
    "stribeck_friction": _NONE,
    "load_dependent_friction": _NONE,
    "armature": _of_dof("dof_armature"),
    "motor_strength": _FACTOR,
    "kp": _FACTOR,
    "kd": _FACTOR,
    "torque_limit": _limit,
    "torque_speed_limit": _UNBOUNDED,
    "command_delay": _delay,
    "command_filter": _NONE,
    "command_rate_limit": _UNBOUNDED,
    "command_profile": lambda plant, place: (np.inf, NO_SPEED_LIMIT),
    "torque_lag": _NONE,
    "encoder_delay": _NONE,
    "dropped_commands": _NONE,
    "encoder_offset": lambda plant, place: (plant.offset[plant.joints.index(place)],),
    "imu_offset": _NONE,
    "encoder_quantisation": _NONE,
    "joint_spring": _spring,
    "asymmetric_friction": _NONE,
    "hysteresis": _NONE,
    "cogging": _NONE,
    "backlash": _NONE,
    "series_elasticity": _UNBOUNDED,
    "link_mass": _of_body("body_mass"),
    "link_com": _of_body("body_ipos"),
    "link_inertia": _of_body("body_inertia"),
    "ground_friction": _ground_friction,
    "ground_compliance": lambda plant, place: (plant.model.geom_solref[int(plant.model.geom(place).id), 0],),
    "ground_slope": _NONE,
    "surface_contact": lambda plant, place: (native.NO_SURFACE, *plant.model.body(place).ipos, 1.0),
    "thermal_fade": _NONE,
    "strength_drift": _NONE,
    "external_wrench": _NONE,
    "discovered": lambda plant, place: (),
}
if unlike := CATALOGUE.keys() ^ _DECLARED.keys():
    where = "bumblebee/diagnosis/simulation/declared.py"
    raise TypeError(f"{where}: _DECLARED needs a row for each of the catalogue's effects, not so: {sorted(unlike)}")
