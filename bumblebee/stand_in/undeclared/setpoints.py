"""Laws of drives that reshape their targets: an input filter, a limited rate, a profile; by the millisecond."""

from dataclasses import dataclass, replace

import numpy as np

from bumblebee.robot.servo_command import ServoCommand
from bumblebee.stand_in.undeclared.law import Law, World

PARTS = 5  # of a millisecond, in which a profile is followed


@dataclass
class CommandFilter(Law):
    """The servo follows its target with the time constant `constant` [s]."""

    joint: str
    constant: float

    def start(self, world: World, target: np.ndarray) -> None:
        """The first target has long been held."""
        self._now = target[:, world.column(self.joint)].copy()

    def command(self, world: World, command: ServoCommand) -> ServoCommand:
        """Mean of the filtered target over the millisecond."""
        j, share = world.column(self.joint), np.exp(-world.dt / self.constant)
        target = command.target.copy()
        away = self._now - target[:, j]
        self._now = target[:, j] + away * share
        target[:, j] += away * (1 - share) * self.constant / world.dt
        return replace(command, target=target)


@dataclass
class CommandRateLimit(Law):
    """Set-point that moves by at most `rate` [rad/s], every millisecond a thousandth of it."""

    joint: str
    rate: float

    def start(self, world: World, target: np.ndarray) -> None:
        """At the first target."""
        self._now = target[:, world.column(self.joint)].copy()

    def command(self, world: World, command: ServoCommand) -> ServoCommand:
        """The mean of before and after."""
        j, most = world.column(self.joint), self.rate * world.dt
        target, before = command.target.copy(), self._now
        self._now = before + np.clip(target[:, j] - before, -most, most)
        target[:, j] = 0.5 * (before + self._now)
        return replace(command, target=target)


@dataclass
class CommandProfile(Law):
    """Set-point that speeds up and slows down by `acceleration` [rad/s^2], as a drive's firmware does it.

    Every fifth of a millisecond it takes the speed from which it can just stop at the target.
    """

    joint: str
    acceleration: float

    def start(self, world: World, target: np.ndarray) -> None:
        """At rest at the first target."""
        self._now = target[:, world.column(self.joint)].copy()
        self._speed = np.zeros(world.count)

    def command(self, world: World, command: ServoCommand) -> ServoCommand:
        """One more millisecond of it, in parts of which the servo follows the mean."""
        j, dt = world.column(self.joint), world.dt / PARTS
        target, most = command.target.copy(), self.acceleration * dt
        wish, mean = target[:, j].copy(), np.zeros(len(target))
        for _ in range(PARTS):
            away = wish - self._now
            stops = np.sqrt(0.25 * most**2 + 2 * self.acceleration * np.abs(away)) - 0.5 * most
            wanted = np.sign(away) * np.minimum(stops, np.abs(away) / dt)
            self._speed = self._speed + np.clip(wanted - self._speed, -most, most)
            mean += (self._now + 0.5 * self._speed * dt) / PARTS
            self._now = self._now + self._speed * dt
        target[:, j] = mean
        return replace(command, target=target)
