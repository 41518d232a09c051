"""Limits of the kinematic rules."""

from dataclasses import dataclass
from typing import Annotated

from bumblebee.ranges import Range, Ranged

Limit = Annotated[float, Range(least=0, most=1e6)]
Speed = Annotated[float, Range(above=0, most=1e6)]


@dataclass(frozen=True)
class FilterConfig(Ranged):
    """Limits of the kinematic rules; a motion beyond one of them is dropped. A very large limit switches a rule off."""

    penetration: Limit = 0.05
    """How deep the robot's lowest point may lie under the floor [m]."""
    floating: Limit = 0.10
    """How high above the floor the robot's lowest point may stay throughout [m]."""
    airborne_height: Limit = 0.20
    """A frame whose lowest point is higher than this counts as airborne [m]."""
    airborne_seconds: Limit = 1.0
    """How long the robot may be airborne without a break [s]."""
    skate: Limit = 0.6
    """How fast the soles may slide over the floor, in the mean over all frames in which they are on it [m/s]."""
    other_contact_height: Limit = 0.02
    """A body that is no foot is on the floor where its lowest point is lower than this [m]."""
    other_contact_seconds: Limit = 2.0
    """How long a body that is no foot may be on the floor without a break [s]: lying, sitting, crawling."""
    joint_excess: Limit = 0.05
    """How far a joint may go beyond its limit [rad]."""
    body_speed: Speed = 15.0
    """How fast a keypoint may move [m/s]."""
    joint_speed: Speed = 40.0
    """How fast a joint may turn [rad/s]; the G1's motors reach 20 to 37."""
    root_speed: Speed = 5.0
    """How fast the pelvis may move from one frame to the next [m/s]; beyond it the motion jumps."""
    root_turn: Speed = 15.0
    """How fast the pelvis may turn from one frame to the next [rad/s]; beyond it the motion flips."""
    root_dip: Limit = 0.45
    """How far the pelvis may sink and rise again within a second [m]; beyond it the motion was fitted to the floor."""
    spike: Speed = 600.0
    """Acceleration of a keypoint over three frames [m/s^2], 60 g; beyond it a frame lies beside its neighbours."""
    self_collision_depth: Limit = 0.05
    """Links whose collision primitives overlap by more than this lie in each other [m]."""
    self_collision_seconds: Limit = 0.5
    """How long links may lie in each other without a break [s]; a hand that brushes a thigh does not count."""
