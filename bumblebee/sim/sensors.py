"""Contact sensors under the feet, which a model needs before the task can use it."""

from pathlib import Path

import mujoco

from bumblebee.errors import BadInput
from bumblebee.robot.drives import buffer_length, explicit_drives
from bumblebee.robot.facts import FEET
from bumblebee.robot.model import build_spec

FLOOR = "floor"


def sensor_name(foot: str) -> str:
    """Name of the contact force sensor of a foot's body."""
    return f"{foot}_floor_force"


def add_foot_sensors(spec: mujoco.MjSpec) -> None:
    """Add the net force between each foot and the floor, world frame, as the sensors `sensor_name(foot)`."""
    force = 1 << int(mujoco.mjtConDataField.mjCONDATA_FORCE)
    net, one = 3, 1  # reduction "netforce": the sum over the contacts, in the world frame
    present = {sensor.name for sensor in spec.sensors}
    for foot in FEET:
        if sensor_name(foot) in present:
            continue
        spec.add_sensor(
            name=sensor_name(foot),
            type=mujoco.mjtSensor.mjSENS_CONTACT,
            objtype=mujoco.mjtObj.mjOBJ_BODY,
            objname=foot,
            reftype=mujoco.mjtObj.mjOBJ_GEOM,
            refname=FLOOR,
            intprm=[force, net, one],
        )


def load_model(path: Path | None = None, physics_hz: float | None = None) -> mujoco.MjModel:
    """`load_spec`, compiled."""
    return load_spec(path, physics_hz).compile()


def load_spec(path: Path | None = None, physics_hz: float | None = None) -> mujoco.MjSpec:
    """The declared model, or the MJCF at `path`, with foot sensors and, if given, another physics rate.

    Raises:
        BadInput: if the file is missing or is not MJCF.
    """
    if path is None:
        spec = build_spec()
    else:
        try:
            spec, _ = explicit_drives(mujoco.MjSpec.from_file(str(path)))
        except (ValueError, OSError) as error:
            came = "no file" if not Path(path).exists() else str(error)
            raise BadInput(path, "a MuJoCo model (MJCF)", came) from None
    add_foot_sensors(spec)
    if physics_hz is not None:
        spec.option.timestep = 1.0 / physics_hz
        for actuator in spec.actuators:
            if actuator.nsample:
                actuator.nsample = buffer_length(actuator.delay, spec.option.timestep)
    return spec
