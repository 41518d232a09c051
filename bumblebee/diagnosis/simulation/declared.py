"""What the declared model says of an effect's parameters in a place."""

import mujoco
import numpy as np

from bumblebee.diagnosis.simulation.plant import Plant
from bumblebee.sim.effects import CATALOGUE, native


def touching(model: mujoco.MjModel, ground: int) -> list[int]:
    """Geometries that the geometry `ground` can touch."""
    types, affinities = model.geom_contype, model.geom_conaffinity
    pairs = ((g, native.touch(types[ground], affinities[ground], types[g], affinities[g])) for g in range(model.ngeom))
    return [g for g, meet in pairs if meet and g != ground]


def declared_values(plant: Plant, kind: str, place: str) -> tuple[float, ...]:
    """The parameters of an effect as the declared model has them; infinite where it knows no bound."""
    model = plant.model
    entry = CATALOGUE[kind]
    if kind in ("link_mass", "link_com", "link_inertia"):
        body = model.body(place).id
        fields = {"link_mass": model.body_mass, "link_com": model.body_ipos, "link_inertia": model.body_inertia}
        declared = tuple(float(x) for x in np.atleast_1d(fields[kind][body]))
        return (*declared, 0.0) if kind == "link_mass" else declared
    if kind == "ground_friction":
        ground = int(model.geom(place).id)
        others = [model.geom_friction[g, 0] for g in touching(model, ground)]
        return (float(max(model.geom_friction[ground, 0], np.median(others) if others else 0.0)),)
    if kind == "ground_compliance":
        return (float(model.geom_solref[int(model.geom(place).id), 0]),)
    if entry.on != "joint" or not place:
        return (0.0,) * len(entry.parameters)
    return _declared_on_joint(plant, kind, plant.joints.index(place))


def _declared_on_joint(plant: Plant, kind: str, column: int) -> tuple[float, ...]:
    model, dof, a = plant.model, plant.dof[column], plant.actuator[column]
    joint = int(model.dof_jntid[dof])
    simple = {
        "coulomb_friction": model.dof_frictionloss[dof],
        "viscous_friction": model.dof_damping[dof],
        "armature": model.dof_armature[dof],
        "command_delay": plant.delay[a] if a >= 0 else 0.0,
        "encoder_offset": plant.offset[column],
        "motor_strength": 1.0,
        "kp": 1.0,
        "kd": 1.0,
        "torque_speed_limit": np.inf,
        "series_elasticity": np.inf,
    }
    if kind in simple:
        return (float(simple[kind]), *(0.0,) * (len(CATALOGUE[kind].parameters) - 1))
    if kind == "torque_limit":
        limited = a >= 0 and model.actuator_forcelimited[a]
        return (float(abs(model.actuator_gear[a, 0]) * model.actuator_forcerange[a, 1]) if limited else np.inf,)
    if kind == "joint_spring":
        stiffness = float(model.jnt_stiffness[joint])
        return (stiffness, stiffness * float(model.qpos_spring[model.jnt_qposadr[joint]]))
    return (0.0,) * len(CATALOGUE[kind].parameters)
