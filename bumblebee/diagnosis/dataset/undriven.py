"""Joints that the logs command and nothing in the model drives: their commands do nothing in the simulation."""

import numpy as np

from bumblebee.diagnosis.simulation import Plant
from bumblebee.errors import BadInput
from bumblebee.measured.rollout import Rollout


def commanded_undriven(plant: Plant, rollouts: list[Rollout]) -> list[str]:
    """The joints without an actuator for which a torque was logged, or a target that changes."""
    some = np.zeros(len(plant.joints), dtype=bool)
    for rollout in rollouts:
        command = rollout.joint_torque_cmd if plant.torque_input else rollout.joint_target
        if command is not None:
            values = np.asarray(command)
            some |= (values != 0).any(axis=0) if plant.torque_input else np.ptp(values, axis=0) > 0
    return [name for name, asked, a in zip(plant.joints, some, plant.actuator, strict=True) if asked and a < 0]


def undriven_warnings(plant: Plant, rollouts: list[Rollout], where: object) -> list[str]:
    """A line on commands that come to nothing; `BadInput` where all do, for nothing can be compared then."""
    names = commanded_undriven(plant, rollouts)
    if not names:
        return []
    listed = ", ".join(names[:6]) + (f" and {len(names) - 6} more" if len(names) > 6 else "")
    if (plant.actuator < 0).all():
        raise BadInput(
            f"{where}: actuator", f"one on a joint that the logs command ({listed})", "a model without actuators",
            "Declare its motors or servos: without them every command does nothing.",
        )  # fmt: skip
    return [
        f"no actuator in the model, yet commanded in the logs: {listed}. These commands have no effect in the model."
    ]
