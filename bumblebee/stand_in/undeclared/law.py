"""A law: one undeclared effect as the places where it acts on a simulated millisecond; neutral unless overridden."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import mujoco
import numpy as np

from bumblebee.robot.servo_command import ServoCommand


@dataclass
class World:
    """State that laws see; R robots, J joints. Arrays are those of the millisecond that begins."""

    joints: tuple[str, ...]
    count: int
    """R."""
    dt: float
    """[s]."""
    rng: np.random.Generator | Sequence[np.random.Generator]
    """Generator for what is random in the truth itself, such as which commands are lost; or one of each robot."""
    time: np.ndarray = field(default_factory=lambda: np.zeros(1))
    """(R,) since the start [s]."""
    q: np.ndarray = field(default_factory=lambda: np.zeros((1, 0)))
    """(R, J) true joint positions [rad]."""
    v: np.ndarray = field(default_factory=lambda: np.zeros((1, 0)))
    """(R, J) true joint velocities [rad/s]."""
    torque: np.ndarray = field(default_factory=lambda: np.zeros((1, 0)))
    """(R, J) torque of the drives in the last millisecond [N m]."""
    error: np.ndarray = field(default_factory=lambda: np.zeros((1, 0)))
    """(R, J) command minus reading [rad]."""
    kp: np.ndarray = field(default_factory=lambda: np.zeros(0))
    """(J,) or (R, J) the servos' gains now [N m/rad]."""

    def column(self, joint: str) -> int:
        """Index of a joint."""
        return self.joints.index(joint)

    def chance(self) -> np.ndarray:
        """(R,) numbers drawn evenly from [0, 1)."""
        if isinstance(self.rng, np.random.Generator):
            return self.rng.random(self.count)
        return np.array([rng.random() for rng in self.rng])


@dataclass(frozen=True, eq=False)
class Seen:
    """Readings of W robots at one tick; J joints. What is read is exact, what is inferred has their noise."""

    joints: tuple[str, ...]
    q: np.ndarray
    """(W, J) readings [rad]."""
    v: np.ndarray
    """(W, J) [rad/s]."""
    torque: np.ndarray
    """(W, J) of the drives, by the servos' law from noisy readings [N m]."""
    growth: np.ndarray
    """(W, J) its change a second."""
    acceleration: np.ndarray
    """(W, J) from noisy speeds around the tick [rad/s^2]."""

    def through(self, joint: str, rotor: float) -> np.ndarray:
        """Torque (W,) [N m] that a rotor of inertia `rotor` [kg m^2] passes on."""
        j = self.joints.index(joint)
        return self.torque[:, j] - rotor * self.acceleration[:, j]


class Law:
    """One undeclared effect on R robots.

    What it remembers of a robot is a row of an array (R, ...) or of a `signals.Line`, in an attribute whose name begins
    with `_`: `memory` takes rows out and puts them back, so that a robot that does not move does not age.
    """

    first = False
    """Whether it changes the model before the others do."""
    parts = 1
    """Steps of the mechanics in a millisecond that it needs."""
    believed = True
    """Whether the drive knows of the gains that it makes of the declared ones."""

    @property
    def chance(self) -> float:
        """Share of the ticks, drawn at random, in which it strikes."""
        return 1.0

    @property
    def grid(self) -> float:
        """Step of the encoder's readings [rad]; 0 for none."""
        return 0.0

    def spec(self, spec: mujoco.MjSpec) -> None:
        """Change the structure before it is compiled."""

    def model(self, model: mujoco.MjModel) -> None:
        """Change the compiled model."""

    def gains(self, kp: np.ndarray, kd: np.ndarray) -> None:
        """Change the servos' gains, (J,) or (R, J), in place."""

    def start(self, world: World, target: np.ndarray) -> None:
        """Begin at rest under `target` (R, J), which has long been held."""

    def settle(self, model: mujoco.MjModel, seen: Seen, qpos: np.ndarray, qvel: np.ndarray) -> None:
        """Guess what no reading determines, here and in the states (W, nq), (W, nv) of `model`, in place."""

    def tick(self, world: World, command: ServoCommand) -> ServoCommand:
        """Change a command of R robots when it is issued, once a control period."""
        return command

    def command(self, world: World, command: ServoCommand) -> ServoCommand:
        """Change a command on its way to the servo, every millisecond."""
        return command

    def feed_forward(self, world: World, torque: np.ndarray) -> np.ndarray:
        """Feed-forward torque (R, J) [N m] that the drive makes of the commanded one; the servo's own is in `gains`."""
        return torque

    def sense(self, world: World, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Encoders' positions and velocities for the servo; called once a millisecond and may keep memory."""
        return q, v

    def read(self, world: World, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Encoders' positions and velocities for the log; the memory stays. By default as the servo senses."""
        return q, v

    def base(self, quat: np.ndarray) -> np.ndarray:
        """Orientation of the base that the IMU reads, (R, 4) wxyz."""
        return quat

    def drive(self, world: World, torque: np.ndarray) -> np.ndarray:
        """Torque (R, J) that the drive makes of the one asked."""
        return torque

    def saturate(self, world: World, torque: np.ndarray) -> np.ndarray:
        """Limits beyond the declared ones."""
        return torque

    def transmit(self, world: World, torque: np.ndarray) -> np.ndarray:
        """Torque that reaches the joint."""
        return torque

    def passive(self, world: World, push: np.ndarray) -> None:
        """Add torques on the joints to `push` (R, J)."""

    def friction(self, world: World, level: np.ndarray) -> None:
        """Change the level of dry friction (R, J) [N m] in place."""

    def inertia(self, world: World, armature: np.ndarray) -> None:
        """Change the rotor inertia that the joints carry, (R, J) [kg m^2], in place."""

    def push(self, world: World, wrench: np.ndarray) -> None:
        """Add forces and torques (R, bodies, 6) on bodies, world frame."""
