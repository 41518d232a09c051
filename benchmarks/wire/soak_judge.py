"""Judges a fault of the soak by what guard and robot have written down: how long after its deadline damping came."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bumblebee.wire.clock import SECOND
from bumblebee.wire.messages import Mode, Order, State
from bumblebee.wire.robot_end.hearing import DEADLINE
from bumblebee.wire.rollouts import ended_by
from bumblebee.wire.safety.guard import PERIOD
from bumblebee.wire.safety.limits import Limits
from bumblebee.wire.safety.phases import Phase

LIMITS = Limits()
SILENT = ("robot stopped", "robot killed", "states without numbers", "states in a burst")
LATE = ("policy stopped", "policy killed")
OWN = ("guard stopped", "guard killed")
"""The robot damps by its own deadline."""
GONE = ("console killed",)
KINDS = (*SILENT, *LATE, *OWN, *GONE)
KILLS = tuple(kind for kind in KINDS if kind.endswith("killed"))


@dataclass(frozen=True)
class Damped:
    """How a fault was answered; times by the stamps of whoever damped."""

    over: float | None
    """Time from the deadline to damping [s]; None where nothing damped."""
    wake: float = 0.0
    """How late the guard itself woke up in that tick [s]."""
    rule: str = ""


def must_damp(kind: str, lasts: float) -> bool:
    """Whether a fault of so long [s] reaches its deadline, whichever tick it begins in."""
    latest = LIMITS.policy_damp + PERIOD / SECOND + 0.02 + 0.02 if kind in LATE else LIMITS.state_damp + 0.005
    return kind in KILLS or lasts > latest


def judged(
    kind: str, begun: int, rows: np.ndarray, orders: Sequence[Order] = (), states: Sequence[State] = ()
) -> Damped:
    """Answer to a fault.

    Args:
        kind: one of `KINDS`.
        begun: when the fault began, by the guard's clock [ns].
        rows: the journal's records.
        orders: all that were heard on the wire since then.
        states: those of the robot.
    """
    if kind in OWN:
        first = next((s for s in states if s.mode is Mode.DAMP), None)
        return Damped(None if first is None else (first.stamp_ns - first.heard_ns) / SECOND - DEADLINE)
    if kind in GONE:  # its last word came before it was killed
        order = next((o for o in orders if o.stamp_ns > begun and o.mode in (Mode.DAMP, Mode.OFF)), None)
        return Damped(None if order is None else (order.stamp_ns - begun) / SECOND - LIMITS.console)
    after = rows[(rows["sent_ns"] >= begun) & (rows["phase"] >= Phase.DAMP)]
    if not len(after) or not (rule := ended_by(rows)):  # a clip that ran to its end damps too
        return Damped(None)
    row = after[0]
    deadline = int(row["came_ns"]) + round(LIMITS.state_damp * SECOND)
    if kind in LATE:
        asked = rows["sent_ns"][(rows["asks"] >= 0) & (rows["sent_ns"] > row["asked_ns"])]
        deadline = int(asked[0]) + PERIOD + round(LIMITS.policy_damp * SECOND)
    return Damped((int(row["sent_ns"]) - deadline) / SECOND, float(row["wake"]) / SECOND, rule)


def lost(begun: int, rows: np.ndarray) -> float:
    """Time before a kill at `begun` [ns] of which the journal has nothing, or a gap [s]."""
    whole = np.flatnonzero(np.diff(rows["order"]) != 1)
    kept = rows[: whole[0] + 1] if len(whole) else rows
    return max(0.0, (begun - int(kept["sent_ns"][-1])) / SECOND)
