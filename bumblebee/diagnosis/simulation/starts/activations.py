"""States of drives with a filter where a window starts: what the commands before it have brought them to."""

import mujoco
import numpy as np

from bumblebee.diagnosis.simulation.variation import Variation
from bumblebee.diagnosis.simulation.windows import Windows

_FILTERS = (int(mujoco.mjtDyn.mjDYN_FILTER), int(mujoco.mjtDyn.mjDYN_FILTEREXACT))


def activations(windows: Windows, variation: Variation, control: np.ndarray) -> np.ndarray:
    """Activations (W, na) at the windows' starts; `control` (W, nu) are the inputs of the first step.

    A filter rests under the first command that its window knows, a tenth of a second or more before the start. What has
    no history of its own, and what follows a set-point, starts at rest with its input.
    """
    model = variation.model
    act, shaped = np.zeros((len(windows), model.na)), {point.actuator for point in variation.setpoints}
    for a in range(model.nu):
        if not model.actuator_actnum[a]:
            continue
        start = control[:, a]
        if a not in shaped and int(model.actuator_dyntype[a]) in _FILTERS:
            start = _filtered(windows, a, float(variation.delay[a]), float(model.actuator_dynprm[a, 0]))
        act[:, model.actuator_actadr[a]] = start
    return act


def _filtered(windows: Windows, actuator: int, delay: float, constant: float) -> np.ndarray:
    """First-order lag (W,) with a time `constant` [s] of the held commands of an actuator, `delay` [s] late, at 0."""
    forgotten = np.exp(np.minimum(windows.command_time + delay, 0.0) / max(constant, mujoco.mjMINVAL))  # (W, C)
    ends = np.concatenate((forgotten[:, 1:], np.ones((len(windows), 1))), axis=1)
    begins = np.concatenate((np.zeros((len(windows), 1)), forgotten[:, 1:]), axis=1)
    return ((ends - begins) * windows.command[..., actuator]).sum(axis=1)
