"""Laws of what lies between a rotor and its joint: play, and a shaft that gives way."""

from dataclasses import dataclass

import mujoco
import numpy as np

from bumblebee.stand_in.undeclared.law import Law, Seen, World

LOSS = 0.2  # damping of a shaft over the root of its stiffness times the rotor's inertia: a tenth of critical
ROTOR = 0.9  # share of the declared armature that turns with the rotor


def _place(model: mujoco.MjModel, joint: str, qpos: np.ndarray, qvel: np.ndarray, q: np.ndarray, v: np.ndarray) -> None:
    """Put a joint of all robots at q, v (W,)."""
    where = model.joint(joint)
    qpos[:, where.qposadr[0]], qvel[:, where.dofadr[0]] = q, v


@dataclass
class Backlash(Law):
    """A rotor that turns freely within `gap` [rad] of the joint; where they touch they move as one.

    While they touch, the joint carries the declared armature and gets the drive's torque. When the rotor would have to
    pull it lets go; when it has crossed the gap it takes the joint along without bouncing.
    """

    joint: str
    gap: float
    on_motor: bool = False
    """Whether the encoder reads the rotor; else it reads the joint."""

    def model(self, model: mujoco.MjModel) -> None:
        """A tenth of the armature, declared or not, stays with the joint when the rotor lets go."""
        self._armature = float(model.dof_armature[model.joint(self.joint).dofadr[0]])
        self._rotor = ROTOR * self._armature

    def start(self, world: World, target: np.ndarray) -> None:
        """Touching on the forward side."""
        j = world.column(self.joint)
        self._side, self._play = np.ones(world.count), np.full(world.count, self.gap / 2)
        self._speed, self._last = world.v[:, j].copy(), world.v[:, j].copy()

    def settle(self, model: mujoco.MjModel, seen: Seen, qpos: np.ndarray, qvel: np.ndarray) -> None:
        """Touching on the side to which the torque less what turns the rotor points."""
        j = seen.joints.index(self.joint)
        self._side = np.where(seen.through(self.joint, self._rotor) < 0, -1.0, 1.0)
        self._play = 0.5 * self.gap * self._side
        self._speed, self._last = seen.v[:, j].copy(), seen.v[:, j].copy()
        if self.on_motor:
            _place(model, self.joint, qpos, qvel, seen.q[:, j] - self._play, seen.v[:, j])

    def transmit(self, world: World, torque: np.ndarray) -> np.ndarray:
        """Nothing, the torque, or the torque and the rotor's blow."""
        j, v = world.column(self.joint), world.v[:, world.column(self.joint)]
        drive = torque[:, j]
        through = drive - self._rotor * (v - self._last) / world.dt
        leaves = (self._side != 0) & (through * self._side < 0)
        self._speed = np.where(leaves | (self._side != 0), v, self._speed)
        self._side = np.where(leaves, 0.0, self._side)
        free = self._side == 0
        self._speed = np.where(free, self._speed + world.dt * drive / self._rotor, self._speed)
        self._play = np.where(free, self._play + world.dt * (self._speed - v), self._play)
        lands = free & (np.abs(self._play) >= self.gap / 2)
        self._side = np.where(lands, np.sign(self._play), self._side)
        self._play = np.clip(self._play, -self.gap / 2, self.gap / 2)
        torque = torque.copy()
        blow = self._rotor * (self._speed - v) / world.dt
        torque[:, j] = np.where(lands, blow, np.where(free, 0.0, drive))
        self._last = v.copy()
        return torque

    def sense(self, world: World, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The rotor's angle and speed, if the encoder sits there."""
        if not self.on_motor:
            return q, v
        j = world.column(self.joint)
        q, v = q.copy(), v.copy()
        q[:, j] += self._play
        v[:, j] = np.where(self._side == 0, self._speed, v[:, j])
        return q, v

    def read(self, world: World, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Encoders' positions and velocities for the log."""
        return self.sense(world, q, v)

    def inertia(self, world: World, armature: np.ndarray) -> None:
        """By whether the rotor touches."""
        j = world.column(self.joint)
        armature[:, j] = np.where(self._side == 0, 0.1, 1.0) * self._armature


@dataclass
class Elastic(Law):
    """A rotor of its own behind a spring of `stiffness` [N m/rad], damped by a tenth of critical.

    The rotor carries the declared armature but for a tenth. It is integrated in 16 parts of a millisecond, the robot in
    4: in one, what the spring passes on would be half a millisecond ahead, as much as its damping.
    """

    joint: str
    stiffness: float
    on_motor: bool = False
    """Whether the encoder reads the rotor; else it reads the joint."""
    parts = 4

    def model(self, model: mujoco.MjModel) -> None:
        """The armature, declared or not, moves to the rotor."""
        dof = model.joint(self.joint).dofadr[0]
        self._rotor = ROTOR * float(model.dof_armature[dof])
        model.dof_armature[dof] *= 0.1

    def start(self, world: World, target: np.ndarray) -> None:
        """With the joint."""
        j = world.column(self.joint)
        self._angle, self._speed = world.q[:, j].copy(), world.v[:, j].copy()
        self._damping = LOSS * np.sqrt(self.stiffness * self._rotor)
        self._given = np.zeros(world.count)

    def settle(self, model: mujoco.MjModel, seen: Seen, qpos: np.ndarray, qvel: np.ndarray) -> None:
        """Twisted as the torque less what turns the rotor would twist it at rest, and as fast as the torque grows."""
        j = seen.joints.index(self.joint)
        q, v = seen.q[:, j], seen.v[:, j]
        self._given = seen.through(self.joint, self._rotor)
        twist, growth = self._given / self.stiffness, seen.growth[:, j] / self.stiffness
        if self.on_motor:
            self._angle, self._speed = q.copy(), v.copy()
            _place(model, self.joint, qpos, qvel, q - twist, v - growth)
        else:
            self._angle, self._speed = q + twist, v + growth

    def transmit(self, world: World, torque: np.ndarray) -> np.ndarray:
        """The drive turns the rotor, the joint gets what the spring gives."""
        j, parts = world.column(self.joint), max(1, round(16 * world.dt / 1e-3))
        dt, given = world.dt / parts, np.zeros(world.count)
        coupling = self._coupling(world, 0.0)
        for part in range(parts):
            self._speed = self._speed + dt * (torque[:, j] - coupling) / self._rotor
            self._angle = self._angle + dt * self._speed
            before, coupling = coupling, self._coupling(world, dt * (part + 1))
            given += 0.5 * (before + coupling) / parts
        torque = torque.copy()
        # The joint's speed is that of half a step ago: the mean about now, not that of the step ahead, is its push.
        torque[:, j], self._given = 0.5 * (self._given + given), given
        return torque

    def _coupling(self, world: World, ahead: float) -> np.ndarray:
        """Torque (R,) of the spring [N m], the joint `ahead` [s] of where it was seen."""
        j = world.column(self.joint)
        twist = self._angle - world.q[:, j] - world.v[:, j] * ahead
        return self.stiffness * twist + self._damping * (self._speed - world.v[:, j])

    def sense(self, world: World, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The rotor's angle and speed, if the encoder sits there."""
        if not self.on_motor:
            return q, v
        j = world.column(self.joint)
        q, v = q.copy(), v.copy()
        q[:, j], v[:, j] = self._angle, self._speed
        return q, v

    def read(self, world: World, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Encoders' positions and velocities for the log."""
        return self.sense(world, q, v)
