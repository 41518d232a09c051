"""A delay of all joints at once: the robot's, or the logger's, whose states came late by as much.

With states late by e, row k holds the state of `time[k] - e` beside the command of `time[k]`. A simulation restarted
from it sees commands that come e too late: the same as a robot with a command delay e. Commands that do not follow from
the states cannot separate the two.
"""

from collections.abc import Sequence
from typing import Any

_LATE = ("command_delay", "encoder_delay")
_ALIKE = 0.004  # [s]: delays of single joints closer than that are one delay


def latency_notes(effects: Sequence[dict[str, Any]], driven: Sequence[str]) -> list[str]:
    """A note where the found delays are of one size on every driven joint.

    Args:
        effects: the contract's list.
        driven: names of the joints with an actuator.
    """
    delays: dict[str, float] = {}
    for entry in effects:
        if entry["effect"] in _LATE:
            for name in entry["where"] or driven:
                delays[name] = entry["parameters"]["delay"]["value"]
    values = [delays.get(name, 0.0) for name in driven]
    if len(driven) < 2 or not values or min(values) <= 0 or max(values) - min(values) > _ALIKE:
        return []
    size = 1e3 * sum(values) / len(values)
    return [
        f"all joints are {size:.1f} ms late: a delay of the robot, or a logger whose states are that old; commands "
        "that do not follow from the states cannot tell. To separate: log a step with the drive's torque"
    ]
