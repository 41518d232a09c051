"""One robot whose declared model comes from a drawing, with its logs."""

from dataclasses import dataclass
from typing import Any

from bumblebee.diagnosis.dataset import Session

MORE = ("nothing", "late commands", "other gains", "a load")
"""Further effects that the model lacks."""


@dataclass(frozen=True, eq=False)
class Case:
    """Case to be diagnosed, and what would be right."""

    session: Session
    sizes: dict[str, dict[str, float]]
    """Effect -> joint -> true size (kg m^2, N m)."""
    row: dict[str, Any]
    """Row of the draw in the results."""
