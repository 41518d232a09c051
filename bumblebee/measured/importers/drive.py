"""Low-level commands of a PD drive, torque = kp (target - q) + kd (target_vel - qd) + feed_forward, as the contract's.

The contract has one target and constant gains a rollout. A log is cut where its gains change, and each stretch of
constant gains becomes a rollout with these in its metadata. Velocity targets and feed-forward torques become part of
the target, target + (feed_forward + kd target_vel) / kp, which commands the same torque. Without gains (kp = kd = 0)
the feed-forward torque is the command.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.measured.pauses import SHORTEST

LOCKED = "A motor that is absent, dead or locked has _ in its place in joints, and its joint stands under locked."
_FOLDED = ("kp", "kd", "target_vel", "feed_forward")


@dataclass(frozen=True)
class Stretch:
    """Rows of one log under constant gains."""

    rows: slice
    values: dict[str, np.ndarray]
    """The columns of the contract in these rows."""
    meta: dict[str, list[float]]
    """kp and kd of each joint."""


def stretches(
    where: str, time: np.ndarray, values: dict[str, np.ndarray], joints: Sequence[str]
) -> tuple[list[Stretch], list[str]]:
    """Cut a log (T rows) where its gains change; returns the stretches, and what was left out, for the notes.

    A stretch shorter than `SHORTEST` is a ramp of the gains.

    Args:
        where: the file, for messages.
        time: (T,) stamps [s].
        values: columns of the contract and of the drive (kp, kd, target_vel, feed_forward), (T, J) each.
        joints: names of the J joints, for messages.

    Raises:
        BadInput: a feed-forward torque or velocity target without kp, or no stretch that can be used.
    """
    if not any(column in values for column in _FOLDED):
        return [Stretch(slice(0, len(time)), values, {})], []
    if "kp" not in values:
        there = next(column for column in _FOLDED if column in values)
        raise BadInput(f"{where}: kp", f"kp beside {there}", "none", "Name the column of kp in the map.")
    gains = np.concatenate((values["kp"], values.get("kd", np.zeros_like(values["kp"]))), axis=1)
    edges = np.flatnonzero((gains[1:] != gains[:-1]).any(axis=1)) + 1
    bounds = [0, *edges.tolist(), len(time)]
    found, left_out, off = [], 0, np.zeros(len(joints), dtype=bool)
    for first, last in pairwise(bounds):
        long_enough = last - first > 1 and time[last - 1] - time[first] >= SHORTEST
        stretch = _stretch(slice(first, last), values) if long_enough else None
        off |= long_enough & (values["kp"][first] == 0)
        found += [stretch] if stretch else []
        left_out += 0 if stretch else last - first
    if not found:
        expected = f"{SHORTEST:g} s under constant gains, kp > 0 of all joints or of none"
        some = [name for name, out in zip(joints, off, strict=True) if out]
        if some and not off.all():
            raise BadInput(f"{where}: kp", expected, f"kp 0 of {', '.join(some)}", LOCKED)
        raise BadInput(f"{where}: kp", expected, f"{len(bounds) - 1} stretches, none of them so")
    return found, [f"{left_out} rows under changing gains, or damped without a target, left out"] if left_out else []


def _stretch(rows: slice, values: dict[str, np.ndarray]) -> Stretch | None:
    """The contract's columns in these rows; None where they cannot say what the drive was told."""
    part = {column: value[rows] for column, value in values.items()}
    zeros = np.zeros_like(part["kp"])
    kp, kd, rate, torque = (part.pop(column, zeros) for column in _FOLDED)
    gains = {"kp": kp[0].tolist(), "kd": kd[0].tolist()}
    if (kp == 0).all() and (kd == 0).all():
        part.pop("joint_target", None)
        return Stretch(rows, part | {"joint_torque_cmd": torque}, {}) if torque.any() else None
    if not (kp > 0).all() or "joint_target" not in part:
        return None
    with np.errstate(all="ignore"):  # what is too large is a finding of the checks, with its row
        part["joint_target"] = part["joint_target"] + (torque + kd * rate) / kp
    return Stretch(rows, part, gains)
