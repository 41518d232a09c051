"""Laws of commands on their way to the drives, and of what encoders and IMU say."""

from dataclasses import dataclass, replace

import mujoco
import numpy as np

from bumblebee.robot.servo_command import ServoCommand
from bumblebee.stand_in.undeclared.law import Law, Seen, World


class Line:
    """A delay line of (R, ...) values, one a millisecond; delays need not be whole milliseconds."""

    def __init__(self, delay: float, dt: float, first: np.ndarray) -> None:
        self._whole, self._share = int(delay / dt), delay / dt - int(delay / dt)
        self.past = [first.copy() for _ in range(self._whole + 2)]

    def push(self, value: np.ndarray) -> np.ndarray:
        """Put the newest value in; what comes out is the mean over this millisecond of the late signal."""
        self.past = [value.copy(), *self.past[:-1]]
        return self.peek()

    def ahead(self, value: np.ndarray) -> np.ndarray:
        """Value that would come out if `value` were put in now."""
        past = [value, *self.past]
        return (1 - self._share) * past[self._whole] + self._share * past[self._whole + 1]

    def peek(self) -> np.ndarray:
        """Value that came out last."""
        return (1 - self._share) * self.past[self._whole] + self._share * self.past[self._whole + 1]


@dataclass
class CommandDelay(Law):
    """Commands arrive `delay` [s] late."""

    joint: str
    delay: float

    def start(self, world: World, target: np.ndarray) -> None:
        """The first command has long been under way."""
        first = target[:, world.column(self.joint)]
        self._line = Line(self.delay, world.dt, np.stack((first, np.zeros_like(first)), axis=1))

    def command(self, world: World, command: ServoCommand) -> ServoCommand:
        """As it was, target and feed-forward torque together."""
        j = world.column(self.joint)
        target = command.target.copy()
        torque = np.zeros_like(target) if command.torque is None else command.torque.copy()
        target[:, j], torque[:, j] = self._line.push(np.stack((target[:, j], torque[:, j]), axis=1)).T
        return replace(command, target=target, torque=torque)


@dataclass
class DroppedCommands(Law):
    """Each command of the whole robot is lost with probability `share`; the one before goes on."""

    share: float

    @property
    def chance(self) -> float:
        """Probability of a lost command, each tick."""
        return self.share

    def start(self, world: World, target: np.ndarray) -> None:
        """The first is there."""
        self._last, self._torque = target.copy(), np.zeros_like(target)

    def tick(self, world: World, command: ServoCommand) -> ServoCommand:
        """Lost for a robot as a whole, with its feed-forward torque."""
        lost = (world.chance() < self.share)[:, None]
        self._last = np.where(lost, self._last, command.target)
        self._torque = np.where(lost, self._torque, 0.0 if command.torque is None else command.torque)
        return replace(command, target=self._last, torque=self._torque)


@dataclass
class EncoderDelay(Law):
    """Servo and log get the encoder's position and velocity `delay` [s] late."""

    joint: str
    delay: float

    def start(self, world: World, target: np.ndarray) -> None:
        """Nothing has moved yet."""
        j = world.column(self.joint)
        self._q = Line(self.delay, world.dt, world.q[:, j] - 0.0)
        self._v = Line(self.delay, world.dt, world.v[:, j] - 0.0)

    def sense(self, world: World, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Goes into the line, comes out late."""
        j = world.column(self.joint)
        q, v = q.copy(), v.copy()
        q[:, j], v[:, j] = self._q.push(q[:, j]), self._v.push(v[:, j])
        return q, v

    def read(self, world: World, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """As the servo would get it now."""
        j = world.column(self.joint)
        q, v = q.copy(), v.copy()
        q[:, j], v[:, j] = self._q.ahead(q[:, j]), self._v.ahead(v[:, j])
        return q, v


@dataclass
class EncoderOffset(Law):
    """The encoder says `offset` [rad] too much, to servo and log."""

    joint: str
    offset: float

    def sense(self, world: World, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Added."""
        q = q.copy()
        q[:, world.column(self.joint)] += self.offset
        return q, v

    def read(self, world: World, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Encoders' positions and velocities for the log."""
        return self.sense(world, q, v)


@dataclass
class EncoderQuantisation(Law):
    """The encoder has steps of `step` [rad], for servo and log; velocities are not touched."""

    joint: str
    step: float

    @property
    def grid(self) -> float:
        """Step of one joint's encoder."""
        return self.step

    def settle(self, model: mujoco.MjModel, seen: Seen, qpos: np.ndarray, qvel: np.ndarray) -> None:
        """Where it reads: what was rounded off is unknown."""
        qpos[:, model.joint(self.joint).qposadr[0]] = seen.q[:, seen.joints.index(self.joint)]

    def sense(self, world: World, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Rounded."""
        j = world.column(self.joint)
        q = q.copy()
        q[:, j] = np.round(q[:, j] / self.step) * self.step
        return q, v

    def read(self, world: World, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Encoders' positions and velocities for the log."""
        return self.sense(world, q, v)


@dataclass
class ImuOffset(Law):
    """The IMU is mounted turned by `angle` [rad] about the base's `axis` (0 roll, 1 pitch)."""

    axis: int
    angle: float

    def base(self, quat: np.ndarray) -> np.ndarray:
        """True orientation times the small turn."""
        turn = np.zeros(4)
        turn[0], turn[1 + self.axis] = np.cos(self.angle / 2), np.sin(self.angle / 2)
        w, x, y, z = quat.T
        a, b, c, d = turn
        return np.stack(
            (w * a - x * b - y * c - z * d, w * b + x * a + y * d - z * c,
             w * c - x * d + y * a + z * b, w * d + x * c - y * b + z * a), axis=1,
        )  # fmt: skip
