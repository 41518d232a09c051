"""Laws of the drives: strength, gains, limits, lag, heat and time."""

from dataclasses import dataclass

import numpy as np

from bumblebee.stand_in.undeclared.law import Law, World


@dataclass
class Gains(Law):
    """Servo gains times `kp` and `kd`."""

    joint: int
    kp: float = 1.0
    kd: float = 1.0

    def gains(self, kp: np.ndarray, kd: np.ndarray) -> None:
        """Before the limit."""
        kp[..., self.joint] *= self.kp
        kd[..., self.joint] *= self.kd


@dataclass
class Strength(Law):
    """A motor that gives `factor` times what its drive asks for, unknown to the drive."""

    joint: int
    factor: float
    believed = False

    def gains(self, kp: np.ndarray, kd: np.ndarray) -> None:
        """Before the limit, as a weak motor constant does."""
        kp[..., self.joint] *= self.factor
        kd[..., self.joint] *= self.factor

    def feed_forward(self, world: World, torque: np.ndarray) -> np.ndarray:
        """Feed-forward torque (R, J) [N m] after the loss of strength."""
        torque = torque.copy()
        torque[:, self.joint] *= self.factor
        return torque


@dataclass
class TorqueLimit(Law):
    """The drive gives at most `limit` [N m]."""

    joint: str
    limit: float

    def saturate(self, world: World, torque: np.ndarray) -> np.ndarray:
        """Clip."""
        j = world.column(self.joint)
        torque[:, j] = np.clip(torque[:, j], -self.limit, self.limit)
        return torque


@dataclass
class TorqueSpeed(Law):
    """Torque limit along the motion that falls linearly to 0 at `speed` [rad/s]; `limit` is that at rest."""

    joint: str
    limit: float
    speed: float

    def saturate(self, world: World, torque: np.ndarray) -> np.ndarray:
        """Clip on the driving side only."""
        j = world.column(self.joint)
        v = world.v[:, j]
        left = self.limit * np.clip(1 - np.abs(v) / self.speed, 0, 1)
        torque[:, j] = np.where(v > 0, np.minimum(torque[:, j], left), np.maximum(torque[:, j], -left))
        return torque


@dataclass
class TorqueLag(Law):
    """The torque follows the one asked with the time constant `constant` [s]."""

    joint: str
    constant: float

    def start(self, world: World, target: np.ndarray) -> None:
        """Begin with the first torque asked."""
        self._now = np.full(world.count, np.nan)

    def drive(self, world: World, torque: np.ndarray) -> np.ndarray:
        """Exact first-order filter."""
        j = world.column(self.joint)
        self._now = np.where(np.isnan(self._now), torque[:, j], self._now)
        self._now = self._now + (torque[:, j] - self._now) * (1 - np.exp(-world.dt / self.constant))
        torque = torque.copy()
        torque[:, j] = self._now
        return torque


@dataclass
class Fade(Law):
    """Strength 1 - `rate` h, never below 0.2; h is the integral of (torque / limit)^2 over time [s]."""

    joint: str
    limit: float
    rate: float

    def start(self, world: World, target: np.ndarray) -> None:
        """Cold."""
        self._heat = np.zeros(world.count)

    def drive(self, world: World, torque: np.ndarray) -> np.ndarray:
        """Weaker the hotter."""
        j = world.column(self.joint)
        torque = torque.copy()
        torque[:, j] *= np.maximum(0.2, 1 - self.rate * self._heat)
        self._heat = self._heat + np.clip(torque[:, j] / self.limit, -1, 1) ** 2 * world.dt
        return torque


@dataclass
class Drift(Law):
    """Strength 1 - `rate` t, never below 0.2."""

    joint: str
    rate: float

    def drive(self, world: World, torque: np.ndarray) -> np.ndarray:
        """Weaker the later."""
        j = world.column(self.joint)
        torque = torque.copy()
        torque[:, j] *= np.maximum(0.2, 1 - self.rate * world.time)
        return torque
