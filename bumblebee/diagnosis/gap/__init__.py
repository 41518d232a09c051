"""How far model and logs are apart, and what that depends on, before any fit."""

from bumblebee.diagnosis.gap.gap import Gap, gap
from bumblebee.diagnosis.gap.page import gap_page

__all__ = [
    "Gap",
    "gap",
    "gap_page",
]
