"""What robot and controller tell each other, whichever wire carries it (paper, section 4.1: 50 Hz policy, 200 Hz drives)."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

VERSION = 1


class Mode(IntEnum):
    """What the drives are to do with an order."""

    OFF = 0
    """No torque at all."""
    DAMP = 1
    """kd alone brakes the joints; the robot sinks."""
    HOLD = 2
    """The order's targets, while the robot hangs or is held."""
    RUN = 3
    """The order's targets, from a policy: the robot carries itself."""


@dataclass(frozen=True)
class State:
    """What one robot with J joints says at one instant of its own clock; arrays are float64."""

    robot: int
    """Drawn anew when the robot boots: another number is another robot, or one that fell over in between."""
    layout: int
    """`layout_of` its joints."""
    sequence: int
    """Counts up by one with each state."""
    stamp_ns: int
    """When it was sampled, by the robot's clock [ns]."""
    joint_pos: np.ndarray
    """(J,) [rad]."""
    joint_vel: np.ndarray
    """(J,) [rad/s]."""
    joint_torque: np.ndarray
    """(J,) [N m] that the drives report."""
    base_quat: np.ndarray
    """(4,) wxyz, world from base, by the IMU."""
    base_ang_vel: np.ndarray
    """(3,) [rad/s] in the base frame."""
    base_lin_vel: np.ndarray
    """(3,) [m/s] in the base frame, by odometry."""
    base_pos: np.ndarray
    """(3,) [m] by odometry, from where the robot booted."""
    temperature: np.ndarray
    """(J,) of the motors [degrees Celsius]; NaN where it is not measured."""
    error: np.ndarray
    """(J,) int64, 0 for a drive that is well."""


@dataclass(frozen=True)
class Order:
    """What the drives are told, in force until the next one; arrays are float64 (J,)."""

    controller: int
    """Drawn when the controller starts: a robot listens to the one that spoke first, until that one is silent."""
    layout: int
    sequence: int
    answers: int
    """Sequence of the newest state that was known."""
    stamp_ns: int
    """When it was sent, by the controller's clock [ns]."""
    mode: Mode
    target: np.ndarray
    """[rad]."""
    kp: np.ndarray
    """[N m/rad]."""
    kd: np.ndarray
    """[N m s/rad]."""
    torque: np.ndarray
    """Feed-forward [N m]."""


@dataclass(frozen=True)
class Card:
    """Who a robot is; sent once a second, so that a controller can refuse it before anything moves."""

    robot: int
    name: str
    joints: tuple[str, ...]
    state_hz: float
    """States a second."""
    kp_most: np.ndarray
    """(J,) largest gains that its drives take."""
    kd_most: np.ndarray


def layout_of(joints: Sequence[str]) -> int:
    """A number for the joints' names and order, positive and below 2**63."""
    digest = hashlib.sha256("\n".join(joints).encode()).digest()
    return int.from_bytes(digest[:8], "big") >> 1
