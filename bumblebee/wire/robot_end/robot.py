"""The stand-in robot on a wire: its world in real time, its own clock, its sensors, its own deadline for orders.

It knows of its base what IMU and odometry say. It hangs in a gantry until an order says that it carries itself. All of
it is a function of the times and messages that it is given, so that a test runs it without a clock.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Annotated

import numpy as np

from bumblebee import quaternions
from bumblebee.motion.kinematics import sole_points
from bumblebee.policy.odometry import Odometry
from bumblebee.policy.robots import CONTROL_HZ
from bumblebee.ranges import Range, Ranged, Seed
from bumblebee.robot.facts import ROBOT, joint_names, joints, stand_pose
from bumblebee.robot.model import gains
from bumblebee.robot.sensors import SensorNoise, Sensors, add_noise, draws
from bumblebee.robot.servo_command import ServoCommand
from bumblebee.stand_in.body import StandInRobots
from bumblebee.stand_in.sealed import Json
from bumblebee.stand_in.undeclared.simulation import STEP
from bumblebee.wire.clock import SECOND
from bumblebee.wire.links.lcm_codec import Codec, encode_card
from bumblebee.wire.links.line import Line, LineFaults
from bumblebee.wire.messages import CARD, STATE, Card, Mode, State, layout_of
from bumblebee.wire.robot_end.gantry import Gantry
from bumblebee.wire.robot_end.hearing import Hearing

_HANGING, _ROPE = 0.10, 0.2  # m of soles above the floor while it hangs; m/s of the rope
_SLIP = 0.05  # s that a busy machine may be behind before the robot's clock stands still
_PERIOD = round(SECOND / CONTROL_HZ)  # ns between two looks at soles, rope and odometry's place


@dataclass(frozen=True)
class RobotSettings(Ranged):
    """How the robot and its line behave."""

    seed: Seed = 0
    """Seed of noise, faults and the robot's clock."""
    state_hz: Annotated[int, Range(least=50, most=1000)] = 500
    """States a second; a whole number of milliseconds apart."""
    clock_ppm: Annotated[float, Range(least=-1000, most=1000)] = 40.0
    """How much faster than the controller's its clock runs [parts in a million]."""
    noise: Annotated[float, Range(least=0, most=10)] = 1.0
    """Factor on the sensors' noise."""
    odometry: bool = True
    """Whether it measures the base's velocity and place; NaN without."""
    gains_share: Annotated[float, Range(above=0, most=100)] = 2.0
    """Largest gains that its drives take, in units of the declared ones."""
    states: LineFaults = field(default_factory=LineFaults)
    """Faults on the way from the robot."""
    orders: LineFaults = field(default_factory=LineFaults)
    """Faults on the way to it."""


class WireRobot:
    """One G1 that listens to orders and tells its state.

    Args:
        effects: entries of the sealed file, empty for none.
        settings: of the robot and its line.
        now: time at which it boots [ns].
    """

    def __init__(self, effects: Sequence[Json], settings: RobotSettings, now: int) -> None:
        seeds = np.random.default_rng(settings.seed).spawn(5)
        self._rng, self._settings, drives = seeds[0], settings, np.array([gains(joint) for joint in joints()])
        names, most = joint_names(), settings.gains_share * drives
        boot = int(seeds[1].integers(1, 1 << 62))
        self.card = Card(boot, True, ROBOT, names, float(settings.state_hz), most[:, 0], most[:, 1])
        self.hearing = Hearing(self.card, layout_of(names))
        self.slipped = 0
        """Time that was lost because the machine was busy [ns]."""
        self._codec, self._kd = Codec(len(names)), drives[:, 1]
        self._in, self._out = Line(settings.orders, seeds[2]), Line(settings.states, seeds[3])
        self._cycles = round(1.0 / settings.state_hz / STEP)
        self._period = round(self._cycles * STEP * SECOND)
        self._next, self._sequence, self._elapsed, self._looked = now, 0, 0, -_PERIOD
        self._clock = int(seeds[1].integers(1, 1 << 40))  # what the robot's clock says at its boot
        self._drive = 1.0 + 1e-6 * settings.clock_ppm
        self._noise = _scaled(settings.noise)
        self._gantry, self._card_due = Gantry(), now
        self.robots = StandInRobots(1, effects, [self._gantry])
        self._gantry.tie(self.robots.batch)
        self._hang(seeds[4])

    def advance(self, now: int, orders: Sequence[bytes]) -> list[tuple[str, bytes]]:
        """Take orders that came just now, live until `now` [ns], and tell what is to be sent."""
        for message in orders:
            self._in.push(now, "", message)
        if now - self._next > _SLIP * SECOND:
            behind = (now - self._next) // self._period * self._period
            self.slipped, self._next = self.slipped + behind, self._next + behind
        while self._next <= now:
            for _, message in self._in.due(self._next):
                self.hearing.take(self._next, message)
            self._live(self._next)
            self._next += self._period
        out = self._out.due(now)
        if now >= self._card_due:
            self._card_due = now + SECOND
            out.append((CARD, encode_card(self.card)))
        return out

    @property
    def next_period(self) -> int:
        """When there is something to do again [ns]."""
        return self._next

    def _hang(self, rng: np.random.Generator) -> None:
        pose = np.concatenate((np.zeros(3), [1.0, 0, 0, 0], stand_pose()))
        pose[2] = _HANGING - sole_points(pose[None, :3], pose[None, 3:7], pose[None, 7:])[..., 2].min()
        self.robots.reset(pose[None], np.zeros((1, len(pose) - 1)), pose[None, 7:])
        self._gantry.take()
        self._arrived = self._command = ServoCommand(pose[None, 7:])
        self._odometry = Odometry(pose[None, :3].copy(), [rng], 1.0 / CONTROL_HZ)
        self._place = pose[:3].copy()

    def _live(self, now: int) -> None:
        """One period of the robot, and the state at its end."""
        mode = self.hearing.mode(now)
        self._obey(mode)
        self.robots.go_on(self._arrived, self._cycles)
        self._elapsed += self._period
        true = self.robots.read()
        read = add_noise(true, self._noise, self._rng.standard_normal((1, draws(true.joint_pos.shape[1]))))
        if self._elapsed - self._looked >= _PERIOD:
            self._looked = self._elapsed
            self._place = self._odometry.seen(np.array([0]), read).base_pos[0].copy()
            self._move_rope(mode, true)
        else:
            self._place += self._period / SECOND * quaternions.rotate(true.base_quat, true.base_lin_vel)[0]
        self._out.push(now, STATE, self._codec.encode_state(self._state(mode, read, true)))

    def _obey(self, mode: Mode) -> None:
        """Give the drives what the order in force and the mode say; laws of issued commands see new targets alone."""
        order = self.hearing.order
        if mode in (Mode.HOLD, Mode.RUN) and order is not None:
            command = ServoCommand(order.target[None], order.torque[None], order.kp, order.kd)
            new = not np.array_equal(command.target, self._command.target)
        else:
            kd = self._kd if mode is Mode.DAMP else np.zeros_like(self._kd)
            target = self._command.target
            command, new = ServoCommand(target, np.zeros_like(target), np.zeros_like(kd), kd), False
        issued = self.robots.issued(command) if new else replace(command, target=self._arrived.target)
        self._command, self._arrived = command, issued
        if mode is Mode.RUN:
            self._gantry.holds = False
        elif not self._gantry.holds:
            self._gantry.take()

    def _move_rope(self, mode: Mode, true: Sensors) -> None:
        """Draw the soles to the floor while it is held by orders, and off it else."""
        lowest = sole_points(np.zeros((1, 3)), true.base_quat, true.joint_pos)[..., 2].min()
        height = -lowest + (0.0 if mode is Mode.HOLD else _HANGING)
        most = _ROPE / CONTROL_HZ
        self._gantry.place[2] += np.clip(height - self._gantry.place[2], -most, most)

    def _state(self, mode: Mode, read: Sensors, true: Sensors) -> State:
        hearing, order = self.hearing, self.hearing.order
        sequence, self._sequence = self._sequence, self._sequence + 1
        clock = self._stamp(self._elapsed)
        since = self._next - hearing.came if order is not None else 0
        known = 1.0 if self._settings.odometry else np.nan
        return State(
            self.card.robot,
            layout_of(self.card.joints),
            sequence,
            clock,
            read.joint_pos[0],
            read.joint_vel[0],
            true.joint_torque[0],
            read.base_quat[0],
            read.base_ang_vel[0],
            known * read.base_lin_vel[0],
            known * self._place,
            true.foot_force[0, :, 2],
            np.full(len(self._kd), np.nan),
            np.zeros(len(self._kd), dtype=np.int64),
            mode,
            order.controller if order is not None else 0,
            order.sequence if order is not None else -1,
            clock - self._stamp_span(since + self._period),
        )

    def _stamp(self, elapsed: int) -> int:
        return self._clock + self._stamp_span(elapsed)

    def _stamp_span(self, elapsed: int) -> int:
        return round(elapsed * self._drive)


def _scaled(factor: float) -> SensorNoise:
    plain = SensorNoise()
    names = ("joint_pos", "joint_vel", "base_ang_vel", "base_quat", "base_lin_vel", "base_pos")
    return SensorNoise(**{name: factor * getattr(plain, name) for name in names}, base="odometry")
