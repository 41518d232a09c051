"""Declared values of an effect's parameters in a place."""

import mujoco
import numpy as np

from bumblebee.diagnosis.simulation.plant import Plant
from bumblebee.effects.places import Spot
from bumblebee.sim.effects import CATALOGUE


def spot(
    plant: Plant,
    place: str,
    model: mujoco.MjModel | None = None,
    delay: np.ndarray | None = None,
    offset: np.ndarray | None = None,
) -> Spot:
    """A place of the plant, or of another model of its layout with its delays (A,) [s] and offsets (J,) [rad]."""
    model, delay = plant.model if model is None else model, plant.delay if delay is None else delay
    offset, supply = plant.offset if offset is None else offset, plant.condition.supply
    return Spot(model, place, plant.joints, plant.dof, plant.actuator, delay, offset, supply)


def declared_values(plant: Plant, kind: str, place: str) -> tuple[float, ...]:
    """The parameters of an effect as the declared model has them; infinite where it knows no bound."""
    entry = CATALOGUE[kind]
    if not place and entry.on == "joint":
        return (0.0,) * len(entry.parameters)
    found = entry.declared(spot(plant, place))
    return (*map(float, found), *(0.0,) * (len(entry.parameters) - len(found)))
