"""How much of each of the guard's limits a motion uses: what was measured, as a share of what the rule allows."""

from dataclasses import dataclass

import numpy as np

from bumblebee.wire.safety.limits import Drives, Limits
from bumblebee.wire.safety.rules import lean

DAMPING = ("tilt", "drop", "joint_range", "speed", "power", "policy_far")
"""Uses beyond 1 that damp; `drop` is the rule `tilt`'s second half. `torque` beyond 1 is cut."""


@dataclass(frozen=True)
class Measured:
    """T rows of a robot: each array (T, ...), by the measured-rollout contract; NaN where nothing is known."""

    joint_pos: np.ndarray
    joint_vel: np.ndarray
    joint_torque: np.ndarray
    action: np.ndarray
    quat: np.ndarray
    height: np.ndarray


@dataclass(frozen=True)
class Use:
    """Largest use of a limit."""

    share: float
    """1 is the limit; the rule acts beyond it."""
    row: int
    joint: str = ""


def uses(measured: Measured, quat: np.ndarray, height: np.ndarray, drives: Drives, limits: Limits) -> dict[str, Use]:
    """Rule -> its largest use over the rows.

    Args:
        measured: T rows.
        quat: (T, 4) orientation of the reference's pelvis, wxyz.
        height: (T,) its height above the floor [m].
        drives: of J joints.
        limits: of the guard.
    """
    margin = 2.0 * limits.beyond * (drives.high - drives.low)
    by_joint = {
        "joint_range": np.abs(2.0 * measured.joint_pos - drives.high - drives.low)
        / (drives.high - drives.low + margin),
        "speed": np.abs(measured.joint_vel) / (limits.speed * drives.speed),
        "torque": np.abs(measured.joint_torque) / (limits.torque * drives.effort),
        "power": np.abs(measured.joint_torque * measured.joint_vel) / (limits.power * drives.effort * drives.speed),
        "policy_far": np.abs(measured.action) / limits.far,
    }
    leans = np.array([lean(one, other) for one, other in zip(measured.quat, quat, strict=True)])
    found = {"tilt": _largest(leans / limits.tilt_deg), "drop": _largest((height - measured.height) / limits.drop_m)}
    return found | {name: _largest(shares, drives.joints) for name, shares in by_joint.items()}


def room(joint_pos: np.ndarray, drives: Drives) -> tuple[float, str]:
    """Smallest distance [rad] of T rows of joint angles (T, J) to an end of a joint's range, and whose it is."""
    ahead = np.minimum(drives.high - joint_pos, joint_pos - drives.low)
    _, joint = np.unravel_index(int(np.argmin(ahead)), ahead.shape)
    return float(ahead.min()), drives.joints[joint]


def _largest(shares: np.ndarray, joints: tuple[str, ...] = ()) -> Use:
    known = np.where(np.isfinite(shares), shares, 0.0)
    row, *joint = (int(index) for index in np.unravel_index(int(np.argmax(known)), known.shape))
    return Use(float(known.max()), row, joints[joint[0]] if joint else "")
