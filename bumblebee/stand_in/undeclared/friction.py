"""Laws of friction, inertia, springs and cogging: torques on one joint beyond those of its drive."""

from dataclasses import dataclass

import mujoco
import numpy as np

from bumblebee.stand_in.undeclared.law import Law, World

STRIBECK_SPEED = 0.15  # [rad/s]
REACH = 0.05  # travel after which hysteresis has turned round [rad]


@dataclass
class Coulomb(Law):
    """Dry friction of `level` [N m]."""

    joint: str
    level: float
    first = True  # others add to it

    def friction(self, world: World, level: np.ndarray) -> None:
        """Absolute, in place of the declared one."""
        level[:, world.column(self.joint)] = self.level


@dataclass
class Stribeck(Law):
    """Dry friction `level` (0.4 + 0.6 exp(-(v / speed)^2)) [N m]: the breakaway is 2.5 times the sliding friction."""

    joint: str
    level: float
    speed: float = STRIBECK_SPEED

    def friction(self, world: World, level: np.ndarray) -> None:
        """By the speed now."""
        j = world.column(self.joint)
        level[:, j] += self.level * (0.4 + 0.6 * np.exp(-((world.v[:, j] / self.speed) ** 2)))


@dataclass
class LoadFriction(Law):
    """Dry friction `share` |drive torque|, as in a loaded gear."""

    joint: str
    share: float

    def friction(self, world: World, level: np.ndarray) -> None:
        """By the torque now."""
        j = world.column(self.joint)
        level[:, j] += self.share * np.abs(world.torque[:, j])


@dataclass
class AsymmetricFriction(Law):
    """Dry friction `forward` [N m] while the joint moves forward, `backward` while it moves back."""

    joint: str
    forward: float
    backward: float

    def friction(self, world: World, level: np.ndarray) -> None:
        """By the direction of motion; at rest by the direction of the drive."""
        j = world.column(self.joint)
        way = np.where(np.abs(world.v[:, j]) > 1e-3, world.v[:, j], world.torque[:, j])
        level[:, j] += np.where(way > 0, self.forward, self.backward)


@dataclass
class Viscous(Law):
    """Torque -`damping` v [N m s/rad]."""

    joint: str
    damping: float

    def passive(self, world: World, push: np.ndarray) -> None:
        """Linear in speed."""
        j = world.column(self.joint)
        push[:, j] -= self.damping * world.v[:, j]


@dataclass
class Armature(Law):
    """Rotor inertia `rotor` [kg m^2] in place of the declared one."""

    joint: str
    rotor: float
    first = True

    def model(self, model: mujoco.MjModel) -> None:
        """The joint's own field."""
        model.dof_armature[model.joint(self.joint).dofadr[0]] = self.rotor


@dataclass
class Spring(Law):
    """Torque -`stiffness` q [N m/rad]."""

    joint: str
    stiffness: float

    def passive(self, world: World, push: np.ndarray) -> None:
        """Linear in position."""
        j = world.column(self.joint)
        push[:, j] -= self.stiffness * world.q[:, j]


@dataclass
class Cogging(Law):
    """Torque `amplitude` sin(`number` q) [N m]."""

    joint: str
    amplitude: float
    number: int

    def passive(self, world: World, push: np.ndarray) -> None:
        """Periodic in position."""
        j = world.column(self.joint)
        push[:, j] += self.amplitude * np.sin(self.number * world.q[:, j])


@dataclass
class Hysteresis(Law):
    """Dahl's friction: torque -`level` z, dz/dt = v/`reach` (1 - sgn(v) z), z in [-1, 1]."""

    joint: str
    level: float
    reach: float = REACH
    """Travel after which the torque has turned round [rad]."""

    def start(self, world: World, target: np.ndarray) -> None:
        """At rest without torque."""
        self._z = np.zeros(world.count)

    def passive(self, world: World, push: np.ndarray) -> None:
        """By the path."""
        j = world.column(self.joint)
        turn = world.v[:, j] * world.dt / self.reach
        self._z = np.clip(self._z + turn * (1 - np.sign(turn) * self._z), -1, 1)
        push[:, j] -= self.level * self._z
