"""One factor on everything that is a force: motion alone cannot tell it.

Masses, inertias, friction, springs and torques times the same number move the same way. As long as one drive
keeps its declared strength that drive sets the factor; where every drive's was fitted the declared masses do.
"""

from collections.abc import Sequence
from typing import Any

_STRENGTH = ("motor_strength", "kp")


def factor_notes(effects: Sequence[dict[str, Any]], driven: Sequence[str]) -> list[str]:
    """A note where the strength of every driven joint was found to differ.

    Args:
        effects: the contract's list.
        driven: names of the joints with an actuator.
    """
    found = {name for entry in effects if entry["effect"] in _STRENGTH for name in entry["where"]}
    if not driven or not set(driven) <= found:
        return []
    return [
        "the strength of every drive was fitted: strengths, friction and inertias are known up to one common factor, "
        "which the declared masses set; their intervals hold for these. To separate: weigh a link, or log the torque"
    ]
