"""Limits of the safety layer: the drives' from the robot's facts and the policy's contract, the rest settings."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.io.read import read_yaml
from bumblebee.ranges import Range, Ranged, Share
from bumblebee.robot.facts import joints

Seconds = Annotated[float, Range(above=0, most=60)]
Factor = Annotated[float, Range(above=0, most=100)]


@dataclass(frozen=True)
class Drives:
    """Facts of J drives, each (J,): the robot's table, and gains and scale of the policy's contract."""

    joints: tuple[str, ...]
    low: np.ndarray
    """[rad]."""
    high: np.ndarray
    """[rad]."""
    speed: np.ndarray
    """Largest velocity [rad/s]."""
    effort: np.ndarray
    """Largest torque [N m]."""
    scale: np.ndarray
    """Target per unit of action [rad]."""
    kp: np.ndarray
    """[N m/rad]."""
    kd: np.ndarray
    """[N m s/rad]."""


def drives_of(contract: Mapping[str, Any]) -> Drives:
    """Drives of the robot that a policy's contract is for."""
    table = joints()
    names = tuple(joint.name for joint in table)
    low, high = np.array([joint.range for joint in table]).T
    speed, effort = (np.array([getattr(joint, name) for joint in table]) for name in ("velocity_limit", "effort_limit"))
    own = (np.asarray(contract[key], dtype=np.float64) for key in ("kp", "kd"))
    return Drives(names, low, high, speed, effort, np.asarray(contract["action"]["scale"], dtype=np.float64), *own)


@dataclass(frozen=True)
class Limits(Ranged):
    """Settings of the safety layer; what is a share or a factor is one of the drives' own limits."""

    soft_zone: Annotated[float, Range(above=0, most=0.5)] = 0.03
    """Share of a joint's range at each end in which the push outward fades."""
    beyond: Share = 0.05
    """Share of a joint's range by which a reading beyond the range damps."""
    speed: Factor = 0.8
    """Share of a drive's velocity limit that damps."""
    torque: Factor = 1.0
    """Share of a drive's torque limit at which targets are cut."""
    stall: Seconds = 1.0
    """Time at the torque limit without motion that damps [s]."""
    still: Factor = 0.01
    """Share of a drive's velocity limit below which a joint does not move."""
    power: Factor = 0.5
    """Share of torque limit times velocity limit of a drive that damps."""
    tilt_deg: Annotated[float, Range(above=0, most=180)] = 45.0
    """Angle between the pelvis and its reference that damps [degrees]."""
    drop_m: Annotated[float, Range(above=0, most=2)] = 0.3
    """Distance of the pelvis below its reference that damps [m]."""
    air: Seconds = 0.8
    """Time without a foot on the floor, where force is measured, that damps [s]."""
    foot_n: Annotated[float, Range(above=0, most=1000)] = 20.0
    """A foot that carries more is on the floor [N]."""
    warm: Annotated[float, Range(above=0, most=200)] = 80.0
    """Temperature of a motor that warns [degrees Celsius]."""
    hot: Annotated[float, Range(above=0, most=200)] = 95.0
    """Temperature that damps [degrees Celsius]."""
    far: Factor = 10.0
    """Largest action, in the policy's own units: targets beyond it damp."""
    state_hold: Seconds = 0.02
    """Age of the newest usable state that holds [s]."""
    state_damp: Seconds = 0.04
    """Age that damps [s]."""
    policy_hold: Seconds = 0.04
    """Time since the newest answer of the policy was due that holds [s]."""
    policy_damp: Seconds = 0.1
    """Time that damps [s]."""
    deaf: Seconds = 0.1
    """Time in which the robot took none of our orders that damps [s]."""
    key: Seconds = 0.7
    """Time without the dead-man's key that damps [s]; a terminal repeats a held key after half a second."""
    console: Seconds = 0.3
    """Time without a word of the console that damps [s]."""
    missed: Annotated[int, Range(least=1, most=1000)] = 2
    """Ticks of the guard missed in a row beyond which it holds."""

    def __post_init__(self) -> None:
        """Refuse steps in the wrong order."""
        super().__post_init__()
        for less, more in (("state_hold", "state_damp"), ("policy_hold", "policy_damp"), ("warm", "hot")):
            self.require(getattr(self, less) < getattr(self, more), less, f"a number below {more}")


def read_limits(path: Path) -> Limits:
    """Limits from a YAML file; keys that it lacks keep their defaults.

    Raises:
        BadInput: naming the key.
    """
    content = read_yaml(path)
    known = [field.name for field in fields(Limits)]
    if not isinstance(content, dict):
        raise BadInput(path, "keys and values", type(content).__name__, f"Its keys are {', '.join(known)}.")
    for key in content:
        if key not in known:
            raise BadInput(f"{path}: {str(key)[:40]}", f"one of {', '.join(known)}", "no such limit", "Remove the key.")
    return Limits(**content)
