"""Actuators of which a log cannot tell what they did: refused, for a simulation would hold them at a command of zero.

The columns have one command a joint. What a tendon or a propeller was told is in none of them; nor is the state of an
actuator that integrates its command, from which a window would have to start.
"""

import mujoco
import numpy as np

from bumblebee.diagnosis.plant import Plant
from bumblebee.errors import BadInput
from bumblebee.sim.servo import ON_JOINT

_PLACES = {
    int(mujoco.mjtTrn.mjTRN_TENDON): "a tendon",
    int(mujoco.mjtTrn.mjTRN_SITE): "a site",
    int(mujoco.mjtTrn.mjTRN_SLIDERCRANK): "a slider-crank",
    int(mujoco.mjtTrn.mjTRN_BODY): "a body",
}
_STATES = {
    int(mujoco.mjtDyn.mjDYN_INTEGRATOR): "integrates its command",
    int(mujoco.mjtDyn.mjDYN_MUSCLE): "is a muscle",
    int(mujoco.mjtDyn.mjDYN_USER): "has dynamics of a plugin",
}


def refuse_unlogged(plant: Plant, where: object) -> None:
    """`BadInput` for an actuator that is on no joint, or whose state the log lacks; `where` names the model.

    A tendon that no command can tighten is none of these: an actuator without gain and bias does nothing.
    """
    model = plant.model
    for a in range(model.nu):
        name, place = model.actuator(a).name or f"number {a}", int(model.actuator_trntype[a])
        if not (np.any(model.actuator_gainprm[a]) or np.any(model.actuator_biasprm[a])):
            continue
        if place not in ON_JOINT:
            raise BadInput(
                f"{where}: actuator {name!r}",
                "actuators on hinges and slides, whose commands are in the log",
                f"one on {_PLACES.get(place, 'something else')}, for which there is no column",
                "Take it out of the model, or drive the joints themselves.",
            )
        if (kind := int(model.actuator_dyntype[a])) in _STATES:
            raise BadInput(
                f"{where}: actuator {name!r}",
                "a motor, a servo or a dcmotor",
                f"one that {_STATES[kind]}: its state is in no column",
                "Declare the servo that it stands for.",
            )
