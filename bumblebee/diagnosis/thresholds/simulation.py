"""Numbers that the simulation of windows goes by."""

from dataclasses import dataclass


@dataclass(frozen=True)
class SimulationThresholds:
    """All of them."""
