"""How much a compensation may do to a robot at most."""

from dataclasses import dataclass
from typing import Annotated

from bumblebee.ranges import Range, Ranged


@dataclass(frozen=True)
class CompensationLimits(Ranged):
    """Bounds of a compensation; whatever lies beyond one is refused, not cut down in silence."""

    torque_share: Annotated[float, Range(above=0, most=0.8)] = 0.5
    """Feed-forward torque over the joint's effort limit: the policy's own drives keep the other half."""
    gain_least: Annotated[float, Range(least=0.2, most=1)] = 0.4
    """Gain sent over the declared one: a softer drive no longer carries the robot if the diagnosis was wrong."""
    gain_most: Annotated[float, Range(least=1, most=4)] = 2.5
    """Gain sent over the declared one, at most: a stiffer drive rings with delays that nobody measured."""
    damping_left: Annotated[float, Range(least=0.1, most=1)] = 0.2
    """Share of the drive's kd that is kept where the joint's own friction damps instead: friction warms up and fades,
    and the drive must then still damp."""
    offset: Annotated[float, Range(above=0, most=0.5)] = 0.3
    """[rad] of an encoder: a larger one is a joint mounted wrongly, and is mounted anew."""
    imu: Annotated[float, Range(above=0, most=0.35)] = 0.2
    """[rad] of the IMU: beyond it balance hangs on the estimate alone."""
    look_ahead: Annotated[float, Range(above=0, most=0.1)] = 0.06
    """[s] by which the reference is sent earlier or later, and a reading carried on: three control steps; a policy that
    is later than that has lost more than its reference."""
    correction_share: Annotated[float, Range(least=0, most=1)] = 0.5
    """Share of a command's delay over which the policy's own correction is carried on at its present rate: at 40 ms on
    eight joints half of it gained most of what there was to gain, and all of it brought the robot down."""
    friction_share: Annotated[float, Range(least=0, most=0.95)] = 0.8
    """Share of friction that is fed forward: less than all, so that it never moves a joint by itself, even where the
    estimate is a tenth too large."""
    spring_reach: Annotated[float, Range(above=0, most=3.2)] = 0.5
    """[rad] of a joint's angle at which a spring's torque is held against `torque_share`: what motions ask of hips
    and ankles; beyond it the torque stays at that share."""
    still_speed: Annotated[float, Range(above=0, most=2)] = 0.1
    """[rad/s] over which the sign of the intended velocity is smoothed: below it a joint is about to turn round, and a
    jump of the torque would shake it."""
