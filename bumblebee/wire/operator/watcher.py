"""Somebody who watches a run from another process: gets what the console knows, and may ask it to stop.

The console never waits for a watcher: what it does not take is dropped, and one that is gone is forgotten.
"""

import json
import socket
from collections.abc import Mapping
from typing import Any

import numpy as np

from bumblebee.wire.links import packets
from bumblebee.wire.operator.screen import Numbers, Table
from bumblebee.wire.safety.limits import Drives, Limits
from bumblebee.wire.safety.phases import Phase
from bumblebee.wire.safety.rules import RULES, Step, lean
from bumblebee.wire.safety.uses import room

STOP = b"stop"
"""All that a watcher can say."""
_UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])


class Watcher:
    """The console's end of a watcher's line.

    Args:
        end: packets to and from the watcher; None for nobody.
    """

    def __init__(self, end: socket.socket | None = None) -> None:
        self._end = end

    @property
    def there(self) -> bool:
        """Whether somebody watches."""
        return self._end is not None

    def show(self, facts: Mapping[str, Any]) -> None:
        """Show facts, or drop them."""
        if self._end is not None:
            try:
                packets.send(self._end, json.dumps(facts, allow_nan=False).encode())
            except packets.Gone:
                self._end = None

    def wants_stop(self) -> bool:
        """Whether it has asked to stop; looks at one packet, however many there are."""
        if self._end is None:
            return False
        try:
            return self._end.recv(len(STOP) + 1) == STOP
        except BlockingIOError:
            return False
        except OSError:
            self._end = None
            return False


def facts_of(numbers: Numbers, table: Table, drives: Drives, limits: Limits) -> dict[str, Any]:
    """Facts of a run as it is now, for JSON; without a record yet none but the number of records.

    Args:
        numbers: of the run so far.
        table: of its stages.
        drives: of the robot.
        limits: of the guard.
    """
    row = numbers.row
    if row is None:
        return {"records": 0}
    torque = np.abs(row["joint_torque"]) / (limits.torque * drives.effort)
    strongest, (left, nearest) = int(np.argmax(torque)), room(row["joint_pos"][None], drives)
    known = {
        "lean_deg": lean(row["base_quat"], _UPRIGHT) if row["base_quat"].any() else np.nan,
        "height_m": row["base_pos"][2],
        "room_rad": left,
        "torque": torque[strongest],
        "hottest": row["hottest"],
    }
    return {
        "records": numbers.count,
        "phase": Phase(row["phase"]).name,
        "step": Step(row["step"]).name,
        "tick": int(row["answers"]),
        "missed": numbers.missed,
        "times": {name: [float(value) for value in times] for name, times in table.items()},
        "rules": dict(numbers.rules.most_common()),
        "now": [name for bit, name in enumerate(RULES) if row["rules"] >> bit & 1],
        "room_joint": nearest,
        "torque_joint": drives.joints[strongest],
        **{name: float(value) if np.isfinite(value) else None for name, value in known.items()},
    }
