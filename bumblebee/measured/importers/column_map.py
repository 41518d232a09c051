"""The map from the contract's columns to a file's own names, joints, units and clock."""

import math
from dataclasses import dataclass, field
from typing import Any, Literal

from bumblebee.measured.rollout import WIDTHS

SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
ANGLE_FACTORS = {"rad": 1.0, "deg": math.pi / 180, "turn": 2 * math.pi, "m": 1.0, "normalised": 1.0}
"""Unit that a map may state -> factor to the contract's, rad and m of slides."""
ANGLES = tuple(ANGLE_FACTORS)
CLOCKS = ("header", "log", "publish")
LAYOUTS = ("unitree_hg",)
LEFT_OUT = "_"
"""In the place of a joint: this element of the file's vectors is left out. In the place of a joint's command: nobody
commands it."""

DRIVE: dict[str, int | str] = {"kp": "J", "kd": "J", "target_vel": "J", "feed_forward": "J"}
"""Columns of a low-level command beside its target: kp [N m/rad], kd [N m s/rad], velocity target [rad/s], feed-forward
torque [N m]. Constant gains become metadata; the others become part of the target (`drive.py`)."""

NAMED: dict[str, int | str] = WIDTHS | DRIVE
"""Every column that a map may name -> its values a row."""

MOVES = ("joint_pos", "joint_vel", "joint_target", "target_vel")
FORCES = ("joint_torque", "joint_torque_cmd", "feed_forward")
"""Columns in the joints' units, and columns of torques; all have one value a joint."""

COMMANDED = ("joint_target", "joint_torque_cmd", "action", *DRIVE)
"""Columns that are in force until the next command; all others are sampled states."""


UNCOMMANDED = ("joint_target", "joint_torque_cmd")
"""Columns in which a joint without an actuator may have `LEFT_OUT` for a name; its values are 0."""


@dataclass(frozen=True)
class ColumnMap:
    """Which columns of a log hold what; a CSV takes the first map of a list whose columns it has."""

    joints: tuple[str, ...]
    """Joints of the model, in the order of the columns or of the vectors' elements; `LEFT_OUT` for one left out."""
    columns: dict[str, tuple[str, ...]]
    """Column of the contract, or of `DRIVE` -> names in the file, one a joint or component; or one that holds all.

    Of a bag `topic:field`, of HDF5 a data set's path. Without joint_vel velocities are differences of the positions.
    In `UNCOMMANDED` columns of a CSV `LEFT_OUT` stands for the command of a joint without an actuator.
    """
    time: tuple[str, ...] = ("time",)
    """Name of the column of time stamps; or of two, of whole seconds and of nanoseconds, as ROS stamps are."""
    time_unit: Literal["s", "ms", "us", "ns"] = "s"
    """Unit of the time stamps; of two columns the first is in s, the second in ns."""
    hz: float = 0.0
    """Rate [Hz] of a log without time stamps (HDF5); 0: it has them."""
    clock: dict[str, str] = field(default_factory=dict)
    """Stamp that counts for each topic of a bag: header, log or publish; under "" for all other topics."""
    grid: Literal["states", "commands"] = "states"
    """Stamps of a bag that become the rows: the joint states', or the commands'."""
    angle_unit: tuple[str, ...] = ()
    """Unit of joint positions, velocities and targets, one of `ANGLES` for all or one a joint; m of slides.

    Empty: the map states none, and it is the contract's, rad and m of slides.
    normalised: any other scale; `scale` and `offset` then lead to rad.
    """
    gyro_unit: Literal["rad", "deg"] = "rad"
    """Unit (a second) of base_ang_vel."""
    quat_order: Literal["wxyz", "xyzw"] = "wxyz"
    """Order of base_quat as the file's columns are named in the map."""
    names: tuple[str, ...] = ()
    """Names of the joints in messages, where they are not the model's; one a joint."""
    locked: tuple[str, ...] = ()
    """Joints of the model that the robot has locked or lacks: they are in no log, and stand still in the model."""
    order: dict[str, tuple[str, ...]] = field(default_factory=dict)
    """Topic of messages without names -> the joints in the order of its values."""
    episode: str = ""
    """Column that numbers the episodes of a file, or HDF5's groups of an episode each; every one becomes a rollout."""
    episodes: Literal["whole", "split"] = "whole"
    """split: a log whose time starts again, or pauses, is cut there, and every take becomes a rollout."""
    rows: Literal["all", "complete"] = "all"
    """complete: rows in which a column of the map has no number are left out."""
    valid: str = ""
    """Column that is 0 in rows that do not count, as `torque_enable` is once a servo was switched off."""
    scale: dict[str, tuple[float, ...]] = field(default_factory=dict)
    """Column of the contract -> factors, one a joint, on its values (in rad where they are angles)."""
    offset: dict[str, tuple[float, ...]] = field(default_factory=dict)
    """Column of the contract -> offsets, one a joint, added after the factors."""
    transmission: dict[str, dict[str, float]] = field(default_factory=dict)
    """Joint -> factors of the motors in whose place joints stand, after scale and offset; see `transmission.py`."""
    meta: dict[str, Any] = field(default_factory=dict)
    """robot, kp, kd, notes and other metadata of the contract."""

    def uncommanded(self, column: str) -> list[int]:
        """Places of the joints whose command, in one of `UNCOMMANDED`, is not in the file."""
        if column not in UNCOMMANDED:
            return []
        return [place for place, name in enumerate(self.columns.get(column, ())) if name == LEFT_OUT]

    def width(self, column: str) -> int:
        """Values a row of a column of `NAMED`, with the joints that are left out."""
        width = NAMED[column]
        return len(self.joints) if width == "J" else int(width)


def _pair(stem: str) -> tuple[str, ...]:
    return (f"{stem}1", f"{stem}2")


_PENDULUM = {"robot": "double_pendulum_A0"}
# The two layouts of dfki-ric-underactuated-lab/double_pendulum; the longer one first.
DOUBLE_PENDULUM = tuple(
    ColumnMap(("joint1", "joint2"), {column: _pair(stem) for column, stem in stems.items()}, meta=_PENDULUM)
    for stems in (
        {"joint_pos": "pos_meas", "joint_vel": "vel_meas", "joint_torque_cmd": "tau_con", "joint_torque": "tau_meas"},
        {"joint_pos": "pos", "joint_vel": "vel", "joint_torque_cmd": "tau"},
    )
)
