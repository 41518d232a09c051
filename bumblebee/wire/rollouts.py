"""From a journal to measured rollouts by the contract: `time` is the robot's stamp, the target is what was sent.

Row k holds the state that the policy was asked with at its control tick k, and the target that went to the drives in
the next tick of the guard, the first that the answer could change: safety's cuts and late answers are in it. What lies
between the stamp and the drives is the wire's latency, and is left in, as on any robot.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.measured.rollout import Rollout
from bumblebee.measured.wire_note import wire_note
from bumblebee.wire.safety.phases import Phase
from bumblebee.wire.safety.rules import RULES, Step

_MEASURED = ("joint_pos", "joint_vel", "joint_torque", "base_quat", "base_ang_vel", "base_lin_vel")


@dataclass(frozen=True)
class Latency:
    """Time from a state's stamp until the drives took the answer to it, by the robot's clock [s]."""

    median: float
    worst: float


def rollout_of(about: Mapping[str, Any], rows: np.ndarray) -> Rollout:
    """The measured rollout of a journal's run; what was before the robot carried itself is left out.

    Raises:
        BadInput: the policy never ran.
    """
    asks = asked(rows)
    if len(asks) < 2:
        raise BadInput(about["id"], "a run in which the policy was asked twice", f"{len(asks)} questions")
    now, then = rows[asks], rows[asks + 1]
    values = {name: now[name].astype(np.float64) for name in _MEASURED}
    values = {name: value for name, value in values.items() if np.isfinite(value).all()}  # a robot may lack odometry
    values["base_quat"] /= np.linalg.norm(values["base_quat"], axis=1, keepdims=True)
    reason = ended_by(rows)
    notes = [f"ended by {reason}"] if reason else []
    cut = int((np.abs(then["target"] - then["wanted"]) > 1e-6).any(axis=1).sum())
    notes += [f"safety cut targets in {cut} of {len(asks)} rows"] if cut else []
    late = latency(rows)
    notes += [wire_note(late.median, late.worst)] if late else []
    meta = {
        key: about[key]
        for key in ("robot", "motion", "policy", "recorded_at", "operator", "compensation")
        if key in about
    }
    meta |= {"kp": then["kp"][-1].tolist(), "kd": then["kd"][-1].tolist(), "notes": "; ".join(notes)}
    return Rollout(
        about["id"],
        tuple(about["joints"]),
        float(about["control_hz"]),
        (now["robot_ns"] - now["robot_ns"][0]) * 1e-9,
        joint_target=then["target"].astype(np.float64),
        action=then["action"].astype(np.float64),
        meta=meta,
        **values,
    )


def ended_by(rows: np.ndarray) -> str:
    """Rules that had damped or switched off when the robot carried itself no more; "" for good order."""
    last = rows[(rows["step"] >= Step.DAMP) & (rows["rules"] > 0)][:1]
    return ", ".join(name for row in last for bit, name in enumerate(RULES) if row["rules"] >> bit & 1)


def asked(rows: np.ndarray) -> np.ndarray:
    """Records (T,) of the control ticks in which the robot carried itself, each with one after it."""
    runs = (rows["phase"] == Phase.RUN) & (rows["asks"] >= 0)
    runs[-1:] = False
    found = np.flatnonzero(runs)
    new = np.diff(rows["robot_ns"][found], prepend=-1) > 0  # a state that was asked with twice is one row
    return found[new]


def latency(rows: np.ndarray) -> Latency | None:
    """The wire's latency; None where the robot does not say which orders it took."""
    asks = asked(rows)
    took = [_taken(rows, ask) for ask in asks]
    known = np.array([value for value in took if value is not None])
    return Latency(float(np.median(known)), float(known.max())) if len(known) else None


def _taken(rows: np.ndarray, ask: int) -> float | None:
    """Time from the stamp of the state in record `ask` until the first order with its answer was taken."""
    number = rows["asked_ns"][ask + 1 : ask + 9] == rows["sent_ns"][ask]
    if not number.any():
        return None
    order = rows["order"][ask + 1 + int(np.argmax(number))]
    after = rows[ask + 1 : ask + 41]
    exact = (after["heard"] == order) & (after["heard_ns"] >= 0)
    return float(after["heard_ns"][np.argmax(exact)] - rows["robot_ns"][ask]) * 1e-9 if exact.any() else None


def new_id(motion: str, existing: Sequence[Path], when: datetime) -> str:
    """Name of a run that no file has yet."""
    stem = f"{motion}-{when:%Y%m%d-%H%M%S}"
    taken = {path.stem for path in existing}
    return next(name for name in (stem, *(f"{stem}-{k}" for k in range(2, 1000))) if name not in taken)
