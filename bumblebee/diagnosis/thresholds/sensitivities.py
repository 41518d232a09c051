"""Numbers that the columns of all candidates go by."""

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Impulses:
    """Settings of the torques whose answers stand for all effects that are torques."""

    segments: int = 5
    """Parts of a window, in each of which every degree of freedom is pushed."""
    torque: float = 0.1
    """Size on a joint, as a share of its typical torque."""
    force: float = 0.01
    """Size on a floating base's translations, as a share of the weight [N/N]."""
    moment: float = 0.002
    """Size on a floating base's rotations, as a share of the weight [N m/N]."""


@dataclass(frozen=True)
class TorqueSignatures:
    """Settings of the torques that effects would have put on the joints."""

    creep: float = 0.02
    """Speed [rad/s, m/s] below which there is no motion that dry friction could be told by."""


@dataclass(frozen=True)
class Ground:
    """Settings of where the ground may push a robot."""

    touching: float = 0.02
    """Distance [m] below which a body may touch: about what base and joints are misread by."""


@dataclass(frozen=True)
class SensitivityThresholds:
    """All of them."""

    impulses: Impulses = field(default_factory=Impulses)
    signatures: TorqueSignatures = field(default_factory=TorqueSignatures)
    ground: Ground = field(default_factory=Ground)
