"""Laws outside the catalogue: what a robot may have and no list foresaw."""

from dataclasses import dataclass, replace

import mujoco
import numpy as np

from bumblebee.robot.servo_command import ServoCommand
from bumblebee.stand_in.undeclared.law import Law, Seen, World

PERIOD = 0.02  # [s] between commands


@dataclass
class PositionFriction(Law):
    """Dry friction `level` (1 + 0.9 sin(3 q + 1)) [N m]: a gear that rubs at some angles."""

    joint: str
    level: float

    def friction(self, world: World, level: np.ndarray) -> None:
        """By the position now."""
        j = world.column(self.joint)
        level[:, j] += self.level * (1 + 0.9 * np.sin(3 * world.q[:, j] + 1))


@dataclass
class OddCogging(Law):
    """Torque `amplitude` (sin 5q + 0.7 sin 15q) [N m]."""

    joint: str
    amplitude: float

    def passive(self, world: World, push: np.ndarray) -> None:
        """Two odd harmonics."""
        j = world.column(self.joint)
        push[:, j] += self.amplitude * (np.sin(5 * world.q[:, j]) + 0.7 * np.sin(15 * world.q[:, j]))


@dataclass
class GainCycle(Law):
    """Strength 1 + `share` sin(2 pi t / 4 s): a drive whose temperature control goes up and down."""

    joint: str
    share: float

    def drive(self, world: World, torque: np.ndarray) -> np.ndarray:
        """By time."""
        torque = torque.copy()
        torque[:, world.column(self.joint)] *= 1 + self.share * np.sin(2 * np.pi * world.time / 4.0)
        return torque


@dataclass
class CrossCoupling(Law):
    """Torque -`stiffness` times another joint's position: a cable that runs over both."""

    joint: str
    other: str
    stiffness: float

    def passive(self, world: World, push: np.ndarray) -> None:
        """One way only."""
        push[:, world.column(self.joint)] -= self.stiffness * world.q[:, world.column(self.other)]


@dataclass
class Tendon(Law):
    """Torque -`stiffness` max(q - `slack`, 0): a tendon that is taut on one side only."""

    joint: str
    stiffness: float
    slack: float

    def passive(self, world: World, push: np.ndarray) -> None:
        """One-sided."""
        j = world.column(self.joint)
        push[:, j] -= self.stiffness * np.maximum(world.q[:, j] - self.slack, 0)


@dataclass
class DwellFriction(Law):
    """Dry friction that grows to `level` [N m] while the joint rests (0.3 s) and is worn off by motion (0.02 rad)."""

    joint: str
    level: float

    def start(self, world: World, target: np.ndarray) -> None:
        """Not yet grown."""
        self._age = np.zeros(world.count)

    def friction(self, world: World, level: np.ndarray) -> None:
        """By the history of rest and motion."""
        j = world.column(self.joint)
        wear = np.abs(world.v[:, j]) * world.dt / 0.02
        self._age = np.clip(self._age + (1 - self._age) * world.dt / 0.3 - self._age * wear, 0, 1)
        level[:, j] += self.level * self._age


@dataclass
class RateLimit(Law):
    """From one control period to the next the target moves by no more than `rate` [rad/s] allows."""

    joint: str
    rate: float

    def start(self, world: World, target: np.ndarray) -> None:
        """At the first target."""
        self._now = target[:, world.column(self.joint)].copy()

    def tick(self, world: World, command: ServoCommand) -> ServoCommand:
        """Slew."""
        j, most = world.column(self.joint), self.rate * PERIOD
        target = command.target.copy()
        self._now = self._now + np.clip(target[:, j] - self._now, -most, most)
        target[:, j] = self._now
        return replace(command, target=target)


@dataclass
class QuantisedCommand(Law):
    """Targets arrive rounded to `step` [rad]."""

    joint: str
    step: float

    def tick(self, world: World, command: ServoCommand) -> ServoCommand:
        """Rounded."""
        j = world.column(self.joint)
        target = command.target.copy()
        target[:, j] = np.round(target[:, j] / self.step) * self.step
        return replace(command, target=target)


@dataclass
class LooseMount(Law):
    """The base gives way: two hinges of `stiffness` [N m/rad] under it."""

    stiffness: float

    def spec(self, spec: mujoco.MjSpec) -> None:
        """Two joints of the body `base`, damped to a tenth of critical at 0.5 kg m^2."""
        damping = 0.2 * np.sqrt(self.stiffness * 0.5)
        for name, axis in (("mount_x", [1, 0, 0]), ("mount_y", [0, 1, 0])):
            joint = spec.body("base").add_joint(name=name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=axis)
            # Stiffness and damping are polynomials in this version of MuJoCo: the first coefficient is the linear one.
            joint.stiffness = np.array([self.stiffness, 0, 0]) if np.ndim(joint.stiffness) else self.stiffness
            joint.damping = np.array([damping, 0, 0]) if np.ndim(joint.damping) else damping

    def settle(self, model: mujoco.MjModel, seen: Seen, qpos: np.ndarray, qvel: np.ndarray) -> None:
        """Leaning as far as the arm's weight and motion bend it, at rest."""
        mount = [model.joint(name).dofadr[0] for name in ("mount_x", "mount_y")]
        dofs = [model.joint(name).dofadr[0] for name in seen.joints]
        data = mujoco.MjData(model)
        qpos[:, mount], qvel[:, mount] = 0.0, 0.0
        for row in range(len(qpos)):
            data.qpos, data.qvel, data.qacc = qpos[row], qvel[row], 0.0
            data.qacc[dofs] = seen.acceleration[row]
            mujoco.mj_inverse(model, data)
            qpos[row, mount] = -data.qfrc_inverse[mount] / self.stiffness


@dataclass
class Drag(Law):
    """Torque -`drag` v |v|: a joint in thick grease or wind."""

    joint: str
    drag: float

    def passive(self, world: World, push: np.ndarray) -> None:
        """Quadratic."""
        j = world.column(self.joint)
        push[:, j] -= self.drag * world.v[:, j] * np.abs(world.v[:, j])


@dataclass
class DeadBand(Law):
    """The servo does nothing while the error is below `band` [rad]."""

    joint: str
    band: float

    def drive(self, world: World, torque: np.ndarray) -> np.ndarray:
        """Take the proportional part of the dead band out."""
        j = world.column(self.joint)
        torque = torque.copy()
        torque[:, j] -= world.kp[..., j] * np.clip(world.error[:, j], -self.band, self.band)
        return torque


@dataclass
class Ripple(Law):
    """Torque `amplitude` sin(2 pi 3 Hz t) [N m]: something that shakes."""

    joint: str
    amplitude: float

    def passive(self, world: World, push: np.ndarray) -> None:
        """By time."""
        push[:, world.column(self.joint)] += self.amplitude * np.sin(2 * np.pi * 3.0 * world.time)
