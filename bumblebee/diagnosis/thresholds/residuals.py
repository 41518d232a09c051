"""Numbers that residuals, whitening and nuisances go by."""

from dataclasses import dataclass


@dataclass(frozen=True)
class ResidualThresholds:
    """All of them."""
