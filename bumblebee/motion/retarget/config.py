"""Settings of retargeting."""

from dataclasses import dataclass, field
from typing import Annotated

from bumblebee.ranges import Count, Positive, Range, Ranged

Small = Annotated[float, Range(above=0, most=10)]


@dataclass(frozen=True)
class ContactConfig(Ranged):
    """When a part of a person's foot stands on the floor."""

    height: Small = 0.04
    """Lower over the floor than this, measured from where it is while it stands; of an adult, `leg` long [m]."""
    speed: Small = 0.5
    """And slower than this; of an adult [m/s]."""
    leg: Small = 0.82
    """The adult's leg from hip to ankle: height and speed are smaller for a smaller person [m]."""
    shortest: Small = 0.08
    """A contact or a gap in one that is shorter is noise [s]."""
    blend: Small = 0.03
    """Standard deviation of the Gaussian over which a contact sets in and ends [s]."""


@dataclass(frozen=True)
class RetargetConfig(Ranged):
    """Terms that the robot's trajectory is fitted to: each one's standard deviation; a smaller one counts more."""

    cutoff: Annotated[float, Range(above=0, most=100)] = 8.0
    """Frequency above which the person's landmarks are noise; zero-phase low-pass [Hz]."""
    segment: Small = 0.03
    """Directions of limbs, torso, hips and shoulders: error of the segment's end [m]."""
    root: Small = 0.05
    """The middle of the hips against the person's, scaled [m]."""
    foot: Small = 0.02
    """Directions of the feet: error of the toe against the heel [m]."""
    sole: Small = 0.003
    """Soles in contact above the floor [m]."""
    clearance: Small = 0.001
    """Soles below the floor [m]."""
    slip: Small = 0.005
    """Horizontal speed of soles in contact [m/s]."""
    acceleration: Positive = 15.0
    """Joint accelerations [rad/s^2]."""
    root_acceleration: Positive = 3.0
    """Acceleration of the root beyond the person's [m/s^2], and its rotation's [10 rad/s^2]."""
    posture: Small = 1.5
    """Joints against their angles at rest [rad]."""
    refit_posture: Small = 0.05
    """Joints of a robot's motion that is fitted again, against the angles that came [rad]."""
    limit: Small = 0.005
    """Joints beyond their range [rad]."""
    speed: Small = 0.5
    """Joints beyond their highest speed [rad/s]."""
    collision: Small = 0.005
    """Links that meet [m]."""
    margin: Annotated[float, Range(least=0, most=0.1)] = 0.005
    """Nearer than this, links meet [m]."""
    iterations: Count = 80
    """Most Gauss-Newton steps."""
    converged: Small = 0.001
    """A step that lowers the sum of squares by less than this share of it ends the search."""
    contact: ContactConfig = field(default_factory=ContactConfig)
    """When a foot stands."""
