"""What kinds of effects have in common: which act abruptly, which need fine steps, which every joint has."""

from collections.abc import Iterable
from typing import Any

from bumblebee.diagnosis.candidates.candidate import Candidate

# What these do grows with no power of their size, in few windows.
ABRUPT = ("backlash",)
# What a person would do to tell an effect from those that look the same.
EXPERIMENTS = {
    "viscous_friction": "vary kd, or command a velocity: a servo's damping follows both, a joint's does not",
    "kd": "vary kd: an error of the gain grows with it, friction does not",
    "kp": "vary kp and hold a known load",
    "motor_strength": "hold a known load at rest, and vary kp and kd together",
    "encoder_offset": "move the joint against a stop of known angle",
    "joint_spring": "move the joint slowly through its whole range, unpowered",
    "asymmetric_friction": "move the joint at the same speed both ways, with the joint's axis vertical",
    "command_delay": "command steps and log the torque",
    "torque_lag": "command steps and log the torque at 500 Hz",
    "encoder_delay": "film the joint, or log a second encoder",
    "dropped_commands": "log the commands as the drive receives them",
    "coulomb_friction": "move at several speeds under several loads",
    "stribeck_friction": "creep through zero speed",
    "load_dependent_friction": "move at the same speed under two loads",
    "hysteresis": "move to and fro by small angles",
    "armature": "accelerate the joint with the link taken off or with a known weight on it",
    "link_mass": "add 2 kg to the link, or weigh it",
    "link_com": "hold the link still in several poses and log the torque",
    "link_inertia": "swing the link fast about each axis",
    "external_wrench": "unplug what is tethered, and repeat in another heading",
    "ground_slope": "turn the robot by 180 degrees on the spot",
    "imu_offset": "turn the robot by 180 degrees on the spot, on a levelled floor",
    "ground_friction": "push a standing robot sideways until it slips",
    "ground_compliance": "drop the robot's foot on the floor",
    "torque_limit": "hold a growing load",
    "torque_speed_limit": "move fast without load and slowly under load",
    "thermal_fade": "repeat the motion after a pause",
    "strength_drift": "repeat the motion after a pause, without one",
    "cogging": "turn the unpowered joint slowly",
    "backlash": "rock the joint with the motor held",
    "series_elasticity": "load the joint with the motor held",
    "encoder_quantisation": "log at rest",
}
SATURATIONS = ("torque_limit", "torque_speed_limit")
# PACE's set (Bjelonic et al. 2025: armature, damping, friction, offset, delay) and the drive's strength.
USUAL = ("coulomb_friction", "viscous_friction", "armature", "motor_strength", "encoder_offset")
# Of a drive that is told its torque: its gears rub with it, and an offset shows as a centre of mass does.
USUAL_OF_TORQUE = (*(kind for kind in USUAL if kind != "encoder_offset"), "load_dependent_friction")
USUAL_OF_ROBOT = ("command_delay",)
USUAL_OF_BODIES = ("link_mass", "link_com")
IMU_TILT = "imu_offset"
# In coarse steps play hits too softly, a limit too late and feet otherwise than they do, and late feedback, computed
# beside the integrator, moves a servo by itself. A tilt is not simulated.
_FINE_ONLY = (
    "torque_lag", "encoder_delay", "encoder_quantisation", "backlash", "series_elasticity", "torque_limit",
    "torque_speed_limit", "ground_friction", "ground_compliance", IMU_TILT,
)  # fmt: skip


def label(c: Candidate) -> dict[str, Any]:
    """How the contract names a candidate."""
    return {"effect": c.effect, "where": [c.where] if c.where else []}


def rough(kinds: Iterable[str]) -> bool:
    """Whether coarse steps do for differences between models with these effects."""
    return not any(kind in _FINE_ONLY for kind in kinds)
