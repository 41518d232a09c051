"""The simulated model of a task: the declared or corrected robot with the ground and the delays that the task asks for.

Delays and terrain change a model's layout and must be there when it is compiled; how long each world's delay is belongs
to its fields (`tracking.worlds.randomisation`).
"""

from pathlib import Path

import mujoco

from bumblebee.robot.drives import buffer_length
from bumblebee.sim.sensors import load_spec
from bumblebee.tracking.config import EnvConfig, Randomisation
from bumblebee.tracking.worlds.terrain import add_terrain


def task_model(config: EnvConfig, path: Path | None = None) -> mujoco.MjModel:
    """The declared model, or the MJCF at `path`, at the task's rate, with its terrain and room for its delays.

    Raises:
        BadInput: if the file is missing or is not MJCF.
    """
    spec = load_spec(path, config.physics_hz)
    add_terrain(spec, config.terrain)
    add_delays(spec, config.randomisation)
    return spec.compile()


def add_delays(spec: mujoco.MjSpec, config: Randomisation) -> None:
    """Give every servo a buffer for the longest delay of its command, on top of a delay that it already has."""
    longest = config.delay[1]
    if not longest:
        return
    for servo in spec.actuators:
        servo.interp = 1  # linear: a delay need not be a whole number of physics steps
        servo.nsample = max(servo.nsample, buffer_length(servo.delay + longest, spec.option.timestep))
        servo.delay = max(servo.delay, 1e-9)  # a delay of 0 would leave the buffer unread
