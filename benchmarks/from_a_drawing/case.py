"""One robot whose declared model comes from a drawing, with its logs."""

from dataclasses import dataclass
from typing import Any

from bumblebee.diagnosis.dataset import Session

MORE = ("nothing", "late commands", "other gains", "a load")
"""What else the model lacks."""


@dataclass(frozen=True, eq=False)
class Case:
    """What is diagnosed, and what would be right."""

    session: Session
    sizes: dict[str, dict[str, float]]
    """Effect -> joint -> true size (kg m^2, N m)."""
    row: dict[str, Any]
    """What of the draw stands in the results."""
