"""Numbers that the gap report goes by."""

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Naming:
    """Thresholds for the words on what a joint's missing torque depends on."""

    part_of_largest: float = 0.1
    """Share of the largest basis function's torque below which another one's quantities are not named."""


@dataclass(frozen=True)
class ReportedTorque:
    """Thresholds for the comparison with the drive's own torque."""

    latest: float = 0.05
    """Delay up to which the best agreement is sought [s]."""
    fewest: int = 50
    """Rows below which a rollout is not used."""


@dataclass(frozen=True)
class GapPage:
    """Size of the page: how much it shows."""

    motions: int = 15
    """Motions that are listed, the worst first."""
    pictures: int = 3
    """Joints whose missing torque is drawn, the most structured first."""


@dataclass(frozen=True)
class GapThresholds:
    """All of them."""

    naming: Naming = field(default_factory=Naming)
    reported_torque: ReportedTorque = field(default_factory=ReportedTorque)
    page: GapPage = field(default_factory=GapPage)
