"""Messages between robot and controller, whichever wire carries them (paper, section 4.1: 50 and 200 Hz)."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

VERSION = 1
STATE, ORDER, CARD = CHANNELS = ("BUMBLEBEE_STATE", "BUMBLEBEE_ORDER", "BUMBLEBEE_CARD")
"""Channels of a wire, one for each kind of message."""


class Mode(IntEnum):
    """Instruction to the drives, beside an order's targets."""

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
    """Readings of one robot with J joints at one instant of its own clock; arrays are float64."""

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
    """(3,) [m] by odometry: x, y from where the robot booted, z above the floor."""
    foot_force: np.ndarray
    """(2,) vertical force on the left and the right foot [N]; NaN where it is not measured."""
    temperature: np.ndarray
    """(J,) of the motors [degrees Celsius]; NaN where it is not measured."""
    error: np.ndarray
    """(J,) int64, 0 for a drive that is well."""
    mode: Mode
    """Mode that the drives are in: DAMP where no order came in time."""
    controller: int
    """Controller that the robot listens to; 0 for none."""
    heard: int
    """Sequence of the order in force; -1 for none."""
    heard_ns: int
    """When that order came, by the robot's clock [ns]; -1 where it does not say."""


@dataclass(frozen=True)
class Order:
    """Command to the drives, in force until the next one; arrays are float64 (J,)."""

    controller: int
    """Drawn when the controller starts: a robot listens to the one that spoke first, until that one is silent."""
    layout: int
    """`layout_of` the joints."""
    sequence: int
    """Counts up by one with each order."""
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
    simulated: bool
    """Whether it is a simulation, which nobody needs to hold a key for."""
    name: str
    """Kind of robot, as exported policies name it."""
    joints: tuple[str, ...]
    state_hz: float
    """States a second."""
    kp_most: np.ndarray
    """(J,) largest kp that its drives take [N m/rad]."""
    kd_most: np.ndarray
    """(J,) largest kd [N m s/rad]."""


def layout_of(joints: Sequence[str]) -> int:
    """A number for the joints' names and order, positive and below 2**63."""
    digest = hashlib.sha256("\n".join(joints).encode()).digest()
    return int.from_bytes(digest[:8], "big") >> 1
