"""Odometry of a walking robot without motion capture: the base's place as its own velocity, summed up.

The velocity is the logged one with its noise (20 mm/s a tick make a walk of 3 mm in a second, growing with the root of
time), a scale that is off by about 1 % and a heading that wanders by about 1 degree in 10 s: an error of 1 to 2 % of
the distance. The height does not drift: while a foot stands it is led back to what the leg's joints say.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bumblebee import quaternions
from bumblebee.motion.kinematics import sole_points
from bumblebee.robot.sensors import SensorNoise, Sensors


@dataclass(frozen=True)
class OdometryErrors:
    """How far a leg odometry is off."""

    scale: float = 0.01
    """Standard deviation of an episode's error of scale."""
    heading: float = 0.005
    """Deviation of the heading after a second [rad]; it grows with the root of time."""
    standing: float = 20.0
    """A foot that carries more stands [N]."""
    settling: float = 0.2
    """Time in which the height is led to the standing leg's [s]."""


class Odometry:
    """Odometry of B robots side by side, each with errors of its own.

    Args:
        start: (B, 3) true places at the start [m], which a robot takes for known.
        rngs: (B) of the robots' own errors.
        period: between two readings [s].
        errors: how large they are.
    """

    def __init__(
        self,
        start: np.ndarray,
        rngs: Sequence[np.random.Generator],
        period: float,
        errors: OdometryErrors | None = None,
    ) -> None:
        self._errors, self._period = errors or OdometryErrors(), period
        self._rngs = [np.random.default_rng(rng.integers(1 << 63)) for rng in rngs]
        self._scale = 1.0 + self._errors.scale * np.array([rng.standard_normal() for rng in self._rngs])
        self._heading = np.zeros(len(start))
        self._place = start.copy()
        self._speed = np.full_like(start, np.nan)  # (B, 3) of the reading before, as it was taken for true

    def seen(self, robots: np.ndarray, sensors: Sensors) -> Sensors:
        """The readings of `robots` (n,) at their next tick, with the place that they believe in."""
        turned = quaternions.rotate(sensors.base_quat, sensors.base_lin_vel)
        cosine, sine = np.cos(self._heading[robots]), np.sin(self._heading[robots])
        ahead, aside = turned[:, 0].copy(), turned[:, 1].copy()
        turned[:, 0], turned[:, 1] = cosine * ahead - sine * aside, sine * ahead + cosine * aside
        speed = self._scale[robots, None] * turned
        before = self._speed[robots]
        begun = np.isfinite(before)
        self._place[robots] += np.where(begun, 0.5 * (before + speed) * self._period, 0.0)
        self._speed[robots] = speed
        self._lead_height(robots, sensors)
        wander = np.array([self._rngs[robot].standard_normal() for robot in robots])
        self._heading[robots] += self._errors.heading * np.sqrt(self._period) * wander
        return replace(sensors, base_pos=self._place[robots])

    def _lead_height(self, robots: np.ndarray, sensors: Sensors) -> None:
        stands = (sensors.foot_force[..., 2] > self._errors.standing).any(axis=1)
        origin = np.zeros((len(robots), 3))
        height = -sole_points(origin, sensors.base_quat, sensors.joint_pos)[..., 2].min(axis=(1, 2))
        share = self._period / self._errors.settling
        self._place[robots, 2] += np.where(stands, share * (height - self._place[robots, 2]), 0.0)


def placed(
    noise: SensorNoise, start: np.ndarray, rngs: Sequence[np.random.Generator], period: float
) -> Callable[[np.ndarray, Sensors], Sensors]:
    """Function that puts the base's place into noisy readings, tick by tick: nothing to do for motion capture."""
    return Odometry(start, rngs, period).seen if noise.base == "odometry" else lambda robots, sensors: sensors
