"""Compensation at the joints of a robot whose effects are known: numbers by joint, bounded, and the plan.

The estimates are used as they are, not the ends of their intervals: too much friction compensation shakes a robot and
too little costs a little accuracy, but that margin is `CompensationLimits.friction_share`, which is wider than any
interval that the diagnosis accepts. Gains, offsets and masses have no safer side.
"""

import hashlib
import json
from dataclasses import asdict, dataclass, fields
from typing import Any

import numpy as np

from bumblebee.compensation.limits import CompensationLimits
from bumblebee.robot.facts import ROBOT


@dataclass(frozen=True)
class PlannedEffect:
    """Fate of one effect in the plan."""

    effect: str
    """Its id in the catalogue."""
    where: tuple[str, ...]
    """Joints or bodies; empty for the whole robot."""
    done: str
    """How it is undone; empty if it is not."""
    size: str
    """With which numbers."""
    why_not: str
    """Why it is left out; empty if it is undone."""


@dataclass(frozen=True)
class Load:
    """A body whose mass or centre is not the declared one."""

    body: str
    mass: tuple[float, float]
    """[kg], declared and true."""
    com: tuple[tuple[float, ...], tuple[float, ...]]
    """[m] in the body's frame, declared and true."""


@dataclass(frozen=True, eq=False)
class Compensation:
    """Numbers for J joints in the order of `joints`; an array of zeros (or ones, of a factor) where nothing is done."""

    joints: tuple[str, ...]
    encoder_offset: np.ndarray
    """(J,) [rad] that the encoder adds."""
    encoder_delay: np.ndarray
    """(J,) [s] age of a reading."""
    lead_time: np.ndarray
    """(J,) [s] by which the reference's part of the target is sent earlier; negative: later."""
    torque_lead: np.ndarray
    """(J,) [s] from sending a feed-forward torque until it acts."""
    kp: np.ndarray
    """(J,) [N m/rad] sent to the drive."""
    kd: np.ndarray
    """(J,) [N m s/rad] sent to the drive."""
    strength: np.ndarray
    """(J,) torque that comes of a unit of torque asked for."""
    damping: np.ndarray
    """(J,) [N m s/rad] of excess damping that the gains do not make up for."""
    dry: np.ndarray
    """(J,) [N m] of excess dry friction."""
    stiction: np.ndarray
    """(J,) [N m] of further dry friction at rest."""
    stiction_speed: np.ndarray
    """(J,) [rad/s] at which that has gone; 1 for none."""
    load_friction: np.ndarray
    """(J,) dry friction as a share of the drive's torque."""
    bias: np.ndarray
    """(J,) [N m] sent constantly."""
    spring: np.ndarray
    """(J,) [N m/rad] of a spring's excess stiffness, sent times the measured angle."""
    armature: np.ndarray
    """(J,) [kg m^2] of excess rotor inertia."""
    imu: np.ndarray
    """(3,) [rad] rotation vector by which the orientation reading is turned, in the base's frame."""
    cogging: tuple[tuple[int, float, float, float], ...]
    """(joint, sine, cosine [N m], periods a turn)."""
    hysteresis: tuple[tuple[int, float, float, float], ...]
    """(joint, amplitude [N m], width [rad], 1 for Dahl's law, 0 for a spring that yields)."""
    terms: tuple[tuple[int, float, str], ...]
    """(joint, coefficient, formula of `effects.terms`)."""
    loads: tuple[Load, ...]
    """Whose gravity is carried."""
    limits: CompensationLimits
    effects_sha256: str
    """Hash of the effects.yaml that it was made from."""
    plan: tuple[PlannedEffect, ...]

    @property
    def sha256(self) -> str:
        """Hash of all of it, as the logs of its runs name it."""
        return hashlib.sha256(json.dumps(as_table(self), sort_keys=True).encode()).hexdigest()


JOINT_ARRAYS = tuple(f.name for f in fields(Compensation) if f.type in (np.ndarray, "np.ndarray") and f.name != "imu")
"""Fields of one number a joint."""


def as_table(compensation: Compensation) -> dict[str, Any]:
    """The compensation as plain data."""
    lists: dict[str, Any] = {name: getattr(compensation, name).tolist() for name in (*JOINT_ARRAYS, "imu")}
    for name in ("cogging", "hysteresis", "terms"):
        lists[name] = [list(row) for row in getattr(compensation, name)]
    return {
        "schema": 1,
        "robot": ROBOT,
        "effects_sha256": compensation.effects_sha256,
        "joints": list(compensation.joints),
        "limits": asdict(compensation.limits),
        **lists,
        "loads": [_plain(asdict(load)) for load in compensation.loads],
        "plan": [_plain(asdict(step)) for step in compensation.plan],
    }


def _plain(value: Any) -> Any:
    """Tuples as lists, all the way down."""
    if isinstance(value, dict):
        return {key: _plain(inner) for key, inner in value.items()}
    return [_plain(inner) for inner in value] if isinstance(value, list | tuple) else value
