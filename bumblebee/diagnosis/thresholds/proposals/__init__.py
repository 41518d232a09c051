"""Numbers that the proposals of the search go by: a class a file of `selection/proposals`."""

from dataclasses import dataclass, field

from bumblebee.diagnosis.thresholds.proposals.drives import (
    DeclaredScale,
    DriveGrid,
    GainParameters,
    Saturation,
    SetPoints,
)
from bumblebee.diagnosis.thresholds.proposals.friction import FrictionFamily, HysteresisLaw, Stribeck
from bumblebee.diagnosis.thresholds.proposals.joints import (
    Backlash,
    EncoderResolution,
    JointElasticity,
    JointMisfit,
    TorqueRipple,
)
from bumblebee.diagnosis.thresholds.proposals.whole import AllJoints, PacketLoss, SurfaceContact

__all__ = [
    "AllJoints",
    "Backlash",
    "DeclaredScale",
    "DriveGrid",
    "EncoderResolution",
    "FrictionFamily",
    "GainParameters",
    "HysteresisLaw",
    "JointElasticity",
    "JointMisfit",
    "PacketLoss",
    "ProposalThresholds",
    "Saturation",
    "SetPoints",
    "Stribeck",
    "SurfaceContact",
    "TorqueRipple",
]


@dataclass(frozen=True)
class ProposalThresholds:
    """All of them."""

    saturation: Saturation = field(default_factory=Saturation)
    backlash: Backlash = field(default_factory=Backlash)
    surface_contact: SurfaceContact = field(default_factory=SurfaceContact)
    joint_elasticity: JointElasticity = field(default_factory=JointElasticity)
    setpoints: SetPoints = field(default_factory=SetPoints)
    drive_grid: DriveGrid = field(default_factory=DriveGrid)
    all_joints: AllJoints = field(default_factory=AllJoints)
    packet_loss: PacketLoss = field(default_factory=PacketLoss)
    stribeck: Stribeck = field(default_factory=Stribeck)
    hysteresis_law: HysteresisLaw = field(default_factory=HysteresisLaw)
    friction_family: FrictionFamily = field(default_factory=FrictionFamily)
    torque_ripple: TorqueRipple = field(default_factory=TorqueRipple)
    gain_parameters: GainParameters = field(default_factory=GainParameters)
    declared_scale: DeclaredScale = field(default_factory=DeclaredScale)
    encoder_resolution: EncoderResolution = field(default_factory=EncoderResolution)
    joint_misfit: JointMisfit = field(default_factory=JointMisfit)
