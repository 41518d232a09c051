"""Messages of a robot with three joints."""

from typing import Any

import numpy as np

from bumblebee.wire.messages import Card, Mode, Order, State, layout_of

JOINTS = ("hip", "knee", "ankle")


def state(sequence: int = 7, stamp_ns: int = 123_456_789_012, **other: Any) -> State:
    """At rest and upright, but for what is said."""
    some = np.array([0.1, -0.2, 0.3])
    values: dict[str, Any] = {
        "joint_pos": some,
        "joint_vel": 0.1 * some,
        "joint_torque": some,
        "base_quat": np.array([1.0, 0.0, 0.0, 0.0]),
        "base_ang_vel": np.zeros(3),
        "base_lin_vel": np.zeros(3),
        "base_pos": np.array([0.0, 0.0, 0.8]),
        "foot_force": np.array([160.0, 160.0]),
        "temperature": np.full(3, 35.0),
        "error": np.zeros(3, dtype=np.int64),
        "mode": Mode.HOLD,
        "controller": 5,
        "heard": 4,
        "heard_ns": stamp_ns - 3_000_000,
    }
    return State(11, layout_of(JOINTS), sequence, stamp_ns, **values | other)


def order(mode: Any = Mode.RUN, **other: Any) -> Order:
    """Targets where the robot is, but for what is said."""
    some = np.array([0.1, -0.2, 0.3])
    values: dict[str, Any] = {"target": some, "kp": some + 40, "kd": some + 2, "torque": np.zeros(3)}
    return Order(5, layout_of(JOINTS), 9, 7, 987_654_321, mode, **values | other)


def card() -> Card:
    """Who it is."""
    return Card(11, True, "three", JOINTS, 500.0, np.full(3, 500.0), np.full(3, 20.0))
