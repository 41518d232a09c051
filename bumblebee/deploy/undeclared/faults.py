"""Which sizes are still a robot with a fault: what its owner might put on the floor without knowing.

The benchmark's largest sizes (`Kind.most`) ask what a law and its simulation can hold. Here a joint may be bad but not
seized, and a load heavy but not another robot. Torques are measured by the servo: what moves a joint that far off its
target [rad]. What the declared robot does by itself, joint by joint, is in peaks.yaml (`benchmarks/peaks.py`).
"""

from collections.abc import Callable
from functools import cache
from importlib.resources import files

import yaml

from bumblebee.deploy.undeclared.kinds import Kind, Place


def _off(angle: float) -> Callable[[Place], float]:
    """A torque [N m] that moves the joint so far off its target [rad]."""
    return lambda p: angle * p.of(p.robot.kp)


def _share(field: str, share: float) -> Callable[[Place], float]:
    return lambda p: share * p.of(getattr(p.robot, field))


def _fixed(value: float) -> Callable[[Place], float]:
    return lambda p: value


LARGEST: dict[str, Callable[[Place], float]] = {
    "coulomb_friction": _off(0.10),  # a gear without grease: 10 N m at the knee, 1.4 at the elbow
    "viscous_friction": _share("kd", 1.0),
    "stribeck_friction": _off(0.12),
    "load_dependent_friction": _fixed(0.5),  # half of what the drive gives is lost
    "asymmetric_friction": _off(0.10),
    "armature": _fixed(3.0),  # four times the declared rotor
    "motor_strength": _fixed(0.5),  # half the torque
    "kp": _fixed(0.5),
    "kd": _fixed(0.6),
    "torque_limit": _fixed(1.5),  # 42 % of what half of the motions ask for
    "torque_speed_limit": _fixed(20.0),  # no torque left at three quarters of the usual peak speed
    "command_delay": _fixed(0.03),
    "torque_lag": _fixed(0.03),
    "encoder_delay": _fixed(0.02),
    "dropped_commands": _fixed(0.4),
    "encoder_offset": _fixed(0.12),  # 7 degrees: a joint calibrated by eye
    "imu_offset": _fixed(0.08),
    "encoder_quantisation": _fixed(0.05),
    "backlash": _fixed(0.08),
    "series_elasticity": lambda p: 0.5 / p.of(p.robot.kp),  # a shaft twice as stiff as the servo
    "cogging": _off(0.08),
    "joint_spring": _share("kp", 0.4),
    "hysteresis": _off(0.10),
    "link_mass": lambda p: min(1.5, 6.0 / p.robot.mass[p.name]),  # a load of 6 kg at most
    "link_com": _fixed(0.06),
    "link_inertia": _fixed(4.0),
    "ground_friction": _fixed(3.0),  # a coefficient of 0.25: a wet floor
    "ground_compliance": _fixed(3.0),
    "ground_slope": _fixed(0.06),
    "thermal_fade": _fixed(1.0),
    "strength_drift": _fixed(0.08),
    "external_wrench": lambda p: 0.08 * 9.81 * sum(p.robot.mass.values()),  # 26 N: a cable that pulls
    "position_friction": _off(0.08),
    "odd_cogging": _off(0.06),
    "gain_cycle": _fixed(0.5),
    "cross_coupling": _share("kp", 0.3),
    "tendon": _share("kp", 0.4),
    "dwell_friction": _off(0.12),
    "rate_limit": _fixed(2.0),  # a third of the usual peak rate
    "quantised_command": _fixed(0.10),
    "drag": _share("kd", 0.5),
    "dead_band": _fixed(0.06),
    "ripple": _off(0.08),
}


def largest(kind: Kind, place: Place) -> float:
    """The largest size of a kind there that is still a robot with a fault."""
    return max(min(LARGEST[kind.name](place), kind.most(place)), kind.least(place))


@cache
def peaks() -> dict[str, tuple[float, float, float]]:
    """Joint of the G1 -> usual peaks of torque [N m], speed [rad/s] and change of the target [rad/s]."""
    table = yaml.safe_load(files(__package__).joinpath("peaks.yaml").read_text())
    return {name: (float(torque), float(speed), float(rate)) for name, (torque, speed, rate) in table.items()}
