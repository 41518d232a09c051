"""Which sizes are still a robot with a fault: what its owner might put on the floor without knowing.

A joint may be bad but must not be seized, a load heavy but not a second robot. The benchmark's largest sizes
(`Kind.most`), chosen for what can be told apart, leave the shipped policy on its feet in most kinds: where a real fault
can be larger, it is here. What the declared robot does by itself, joint by joint, is in peaks.yaml
(`benchmarks/peaks.py`).
"""

from collections.abc import Callable
from functools import cache
from importlib.resources import files

import yaml

from bumblebee.deploy.undeclared.kinds import KINDS, Kind, Place, fits


def _share(field: str, share: float) -> Callable[[Place], float]:
    return lambda p: share * p.of(getattr(p.robot, field))


def _fixed(value: float) -> Callable[[Place], float]:
    return lambda p: value


def _mass(p: Place) -> float:
    return p.robot.mass[p.name]


LARGEST: dict[str, Callable[[Place], float]] = {
    "coulomb_friction": _share("limit", 0.2),  # a gear without grease: 28 N m at the knee, 5 at the elbow
    "viscous_friction": _share("kd", 2.0),
    "quadratic_friction": _share("kd", 0.5),  # more is not stable at 1 ms in a fall
    "stribeck_friction": _share("limit", 0.2),
    "load_dependent_friction": _fixed(0.6),  # share of what the drive gives that is lost
    "asymmetric_friction": _share("limit", 0.2),
    "armature": _fixed(4.0),  # five times the declared rotor
    "motor_strength": _fixed(0.8),  # a fifth is left
    "kp": _fixed(0.7),
    "kd": _fixed(0.8),
    "torque_limit": _fixed(4.0),  # 21 % of what half of the motions ask for: a drive that protects itself
    "torque_speed_limit": _fixed(60.0),  # no torque left at 72 % of the usual peak speed
    "command_delay": _fixed(0.06),  # three control periods
    "command_filter": _fixed(0.08),  # four control periods
    "command_rate_limit": _fixed(5.0),
    "command_profile": _fixed(0.3),  # the usual peak rate is reached after 0.3 s
    "torque_lag": _fixed(0.05),
    "encoder_delay": _fixed(0.03),
    "dropped_commands": _fixed(0.6),
    "encoder_offset": _fixed(0.25),  # 14 degrees: a joint calibrated by eye, or a tooth further
    "imu_offset": _fixed(0.12),
    "encoder_quantisation": _fixed(0.10),  # 63 steps a turn
    "backlash": _fixed(0.15),
    "series_elasticity": lambda p: 0.5 / p.of(p.robot.kp),  # a shaft twice as stiff as the servo
    "cogging": _share("limit", 0.15),
    "joint_spring": _share("kp", 1.0),
    "hysteresis": _share("limit", 0.15),
    "link_mass": lambda p: min(max(1.5 * _mass(p), 3.0), 10.0) / _mass(p),  # 3 kg in a hand, 10 on the back
    "link_com": _fixed(0.08),
    "link_inertia": _fixed(4.0),
    "ground_friction": _fixed(6.0),  # a coefficient of 0.14: ice
    "ground_compliance": _fixed(4.0),
    "ground_slope": _fixed(0.10),
    "thermal_fade": _fixed(5.0),
    "strength_drift": _fixed(0.10),
    "external_wrench": lambda p: 0.12 * 9.81 * sum(p.robot.mass.values()),  # 39 N: a cable that pulls
    "position_friction": _share("limit", 0.15),
    "odd_cogging": _share("limit", 0.12),
    "gain_cycle": _fixed(0.8),
    "cross_coupling": _share("kp", 0.6),
    "tendon": _share("kp", 1.0),
    "dwell_friction": _share("limit", 0.2),
    "rate_limit": _fixed(5.0),  # a sixth of the usual peak rate
    "quantised_command": _fixed(0.20),
    "drag": _share("kd", 0.5),  # more is not stable at 1 ms in a fall
    "dead_band": _fixed(0.10),
    "ripple": _share("limit", 0.15),
}
if unlike := LARGEST.keys() ^ {name for name, kind in KINDS.items() if fits(kind, "g1")}:
    where = "bumblebee/deploy/undeclared/faults.py"
    raise TypeError(f"{where}: LARGEST needs a row for each kind that a G1 can have, not so: {sorted(unlike)}")


def largest(kind: Kind, place: Place) -> float:
    """The largest size of a kind there that is still a robot with a fault."""
    held = kind.most(place) if kind.name == "series_elasticity" else float("inf")  # a softer shaft swings by itself
    return max(min(LARGEST[kind.name](place), held), kind.least(place))


@cache
def peaks() -> dict[str, tuple[float, float, float]]:
    """Joint of the G1 -> usual peaks of torque [N m], speed [rad/s] and change of the target [rad/s]."""
    table = yaml.safe_load(files(__package__).joinpath("peaks.yaml").read_text())
    return {name: (float(torque), float(speed), float(rate)) for name, (torque, speed, rate) in table.items()}
