"""A robot as it is: 1 ms semi-implicit Euler, torque motors, a servo loop of its own at 1 kHz, and laws.

The mechanics take shorter steps under the same torque where a law needs them (`Law.parts`).
Dry friction is MuJoCo's constraint (it can hold a joint still) made stiff, its level written every millisecond; all
other torques are computed here in NumPy.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from mujoco.batch import Batch

from bumblebee.robot.servo_command import ServoCommand
from bumblebee.stand_in.undeclared.declared import Declared
from bumblebee.stand_in.undeclared.law import Law, World
from bumblebee.stand_in.undeclared.memory import put, taken
from bumblebee.stand_in.undeclared.model import SOLVER, overriding, true_model

STEP = 0.001  # [s]
CYCLES = 20  # of 1 ms in a control period of 20 ms
_HOOKS = ("tick", "command", "feed_forward", "sense", "read", "drive", "saturate", "transmit", "passive", "friction",
          "inertia", "push")  # fmt: skip


@dataclass(frozen=True)
class Moving:
    """The robots that step now, n of R."""

    rows: np.ndarray | slice
    """Which."""
    world: World
    """State of these n robots alone."""
    laws: Sequence[Law]
    """With the memory of these n alone."""
    acting: dict[str, tuple[int, ...]]
    """Hook -> which laws do something there."""

    def of(self, hook: str) -> Iterator[Law]:
        """Laws that do something at a hook."""
        return (self.laws[i] for i in self.acting[hook])


@dataclass(frozen=True)
class Gains:
    """Gains of the servos, (J,) or (n, J) each: kp [N m/rad], kd [N m s/rad], and those that the drives reckon with."""

    kp: np.ndarray
    kd: np.ndarray
    believed_kp: np.ndarray
    believed_kd: np.ndarray


class TrueRobots:
    """R copies of one true robot side by side; of robots that do not step, no time passes in any law.

    Args:
        robot: what is declared of it.
        laws: what is not.
        count: R.
        rng: of what is random in the truth.
        parts: steps of the mechanics in a millisecond, at least.
        solver: solver iterations; None for those that are declared, but where a law rubs.
    """

    def __init__(
        self,
        robot: Declared,
        laws: Sequence[Law],
        count: int,
        rng: np.random.Generator,
        parts: int = 1,
        solver: int | None = SOLVER,
    ) -> None:
        self.robot, self.laws = robot, sorted(laws, key=lambda law: not law.first)
        self._parts = max((law.parts for law in self.laws), default=1)
        self._parts = max(self._parts, parts)
        self.model = true_model(robot, self.laws, STEP / self._parts, solver)
        self.kp, self.kd = robot.kp.copy(), robot.kd.copy()
        ids = [self.model.joint(name).id for name in robot.joints]
        self._q, self._v = _span(self.model.jnt_qposadr[ids]), _span(self.model.jnt_dofadr[ids])
        self._acting = {hook: overriding(self.laws, hook) for hook in _HOOKS}
        self._unknown = any(not law.believed for law in self.laws)
        self.world = World(robot.joints, count, STEP, rng)
        self.batch = Batch(self.model, count, 1)
        self._qpos, self._qvel = self.batch.bind("qpos"), self.batch.bind("qvel")
        self._push = self.batch.bind("qfrc_applied")
        self._wrench = self.batch.bind("xfrc_applied")
        self._rub = self.batch.expand("dof_frictionloss") if self._acting["friction"] else None
        self._inertia = self.batch.expand("dof_armature") if self._acting["inertia"] else None
        self.everyone = np.arange(count)
        self.reported = np.zeros((count, len(self.kp)))
        """(R, J) torque that the drives believe they gave in the last millisecond [N m]."""

    def reset(self, qpos: np.ndarray, qvel: np.ndarray, target: np.ndarray) -> None:
        """Put all robots at qpos (R, nq), qvel (R, nv) of the declared model, `target` (R, J) long held."""
        self.batch.reset()
        self._qpos[:], self._qvel[:] = self.model.qpos0, 0.0
        self._qpos[:, self._q], self._qvel[:, self._v] = qpos[:, -len(self.kp) :], qvel[:, -len(self.kp) :]
        if self.robot.floating:
            self._qpos[:, :7], self._qvel[:, :6] = qpos[:, :7], qvel[:, :6]
        self.batch.bind("qacc_warmstart")[:] = 0.0
        self._push[:] = self._wrench[:] = 0.0
        self.world.time = np.zeros(self.world.count)
        self.world.torque = np.zeros_like(target)
        self._see(self._moving(None))
        for law in self.laws:
            law.start(self.world, target)

    def resume(self, qpos: np.ndarray, qvel: np.ndarray, torque: np.ndarray, time: np.ndarray) -> None:
        """Go on from states (R, nq'), (R, nv') of this very model after `time` (R,); the laws remember already."""
        self.batch.reset()
        self._qpos[:], self._qvel[:] = qpos, qvel
        self.batch.bind("qacc_warmstart")[:] = 0.0
        self._push[:] = self._wrench[:] = 0.0
        self.world.time, self.world.torque = time, torque.copy()
        self._see(self._moving(None))

    def own_state(self) -> tuple[np.ndarray, np.ndarray]:
        """The model's own state, (R, nq'), (R, nv')."""
        return self._qpos.copy(), self._qvel.copy()

    def readings(self) -> tuple[np.ndarray, np.ndarray]:
        """Readings of the encoders, positions and velocities (R, J)."""
        q, v = self._qpos[:, self._q].copy(), self._qvel[:, self._v].copy()
        for i in self._acting["read"]:
            q, v = self.laws[i].read(self.world, q, v)
        return q, v

    def orientation(self) -> np.ndarray:
        """Orientation of the base that the IMU reads, (R, 4) wxyz."""
        quat = self._qpos[:, 3:7] / np.linalg.norm(self._qpos[:, 3:7], axis=1, keepdims=True)
        for law in self.laws:
            quat = law.base(quat)
        return quat

    def state(self) -> tuple[np.ndarray, np.ndarray]:
        """State that perfect sensors with this robot's faults would read, as (R, nq), (R, nv) of the declared model."""
        q, v = self.readings()
        if not self.robot.floating:
            return q, v
        qpos = np.concatenate((self._qpos[:, :3], self.orientation(), q), axis=1)
        return qpos, np.concatenate((self._qvel[:, :6], v), axis=1)

    @property
    def torque(self) -> np.ndarray:
        """Torque of the drives in the last millisecond, (R, J) [N m]."""
        return self.world.torque

    def step(self, command: ServoCommand, robots: np.ndarray | None = None, cycles: int = CYCLES) -> None:
        """Issue a command of n robots and let them move for one control period; all robots by default."""
        now = self._moving(robots)
        for law in now.of("tick"):
            command = law.tick(now.world, command)
        self._hold(now, command, cycles)

    def arrived(self, target: np.ndarray) -> np.ndarray:
        """Targets (R, J) [rad] as they arrive at the servos when they are issued."""
        return self.issued(ServoCommand(target)).target

    def hold(self, arrived: np.ndarray) -> None:
        """Hold what has arrived (R, J) for one control period."""
        self.go_on(ServoCommand(arrived), CYCLES)

    def issued(self, command: ServoCommand) -> ServoCommand:
        """Command to all robots as it is after it was issued."""
        for i in self._acting["tick"]:
            command = self.laws[i].tick(self.world, command)
        return command

    def go_on(self, arrived: ServoCommand, cycles: int) -> None:
        """Let all robots move for some milliseconds under a command that has arrived."""
        self._hold(self._moving(None), arrived, cycles)

    def settle(self, target: np.ndarray) -> None:
        """Forces and accelerations where the robots are, under targets (R, J); no time passes."""
        now, command = self._taken(self.everyone), ServoCommand(target)
        believed, torque = self._drive(now, command, self._gains(now, command))
        now.world.torque = torque
        self._apply(now, torque)
        self.batch.forward()
        self.reported[:] = np.clip(believed, -self.robot.limit, self.robot.limit)

    def _moving(self, robots: np.ndarray | None) -> Moving:
        if robots is None or len(robots) == self.world.count:
            return Moving(slice(None), self.world, self.laws, self._acting)
        return self._taken(robots)

    def _taken(self, rows: np.ndarray) -> Moving:
        """Some robots, with copies of what is remembered of them."""
        world = self.world
        rng = world.rng if isinstance(world.rng, np.random.Generator) else [world.rng[row] for row in rows]
        own = World(world.joints, len(rows), STEP, rng, world.time[rows], torque=world.torque[rows])
        return Moving(rows, own, taken(self.laws, rows), self._acting)

    def _hold(self, now: Moving, command: ServoCommand, cycles: int) -> None:
        gains = self._gains(now, command)
        believed = np.zeros_like(command.target)
        for _ in range(cycles):
            believed = self._cycle(now, command, gains)
        self.reported[now.rows] = np.clip(believed, -self.robot.limit, self.robot.limit)
        if not isinstance(now.rows, slice):
            self.world.time[now.rows], self.world.torque[now.rows] = now.world.time, now.world.torque
            put(self.laws, now.rows, now.laws)

    def _gains(self, now: Moving, command: ServoCommand) -> Gains:
        """The servos' gains, as they are and as the drives believe them."""
        kp = self.kp if command.kp is None else command.kp
        kd = self.kd if command.kd is None else command.kd
        gains = Gains(*(np.array(x, dtype=np.float64) for x in (kp, kd, kp, kd)))
        for law in self.laws:
            law.gains(gains.kp, gains.kd)
            if law.believed:
                law.gains(gains.believed_kp, gains.believed_kd)
        now.world.kp = gains.kp
        return gains

    def _see(self, now: Moving) -> None:
        q, v = self._qpos[now.rows, self._q], self._qvel[now.rows, self._v]
        live = isinstance(now.rows, slice)
        now.world.q, now.world.v = (q.copy(), v.copy()) if live else (q, v)

    def _cycle(self, now: Moving, command: ServoCommand, gains: Gains) -> np.ndarray:
        """One millisecond; gives the torque (n, J) that the drives were asked for, as they believe."""
        world = now.world
        believed, torque = self._drive(now, command, gains)
        world.torque = torque
        world.dt = STEP / self._parts
        for part in range(self._parts):
            if part:
                self._see(now)
            self._apply(now, torque)
            self.batch.step(ids=self.everyone[now.rows])
            world.time = world.time + world.dt
        world.dt = STEP
        return believed

    def _drive(self, now: Moving, command: ServoCommand, gains: Gains) -> tuple[np.ndarray, np.ndarray]:
        """Torque that the drives were asked for, as they believe, and the torque that they give, (n, J)."""
        world = now.world
        self._see(now)
        q, v = world.q, world.v
        for law in now.of("command"):
            command = law.command(world, command)
        for law in now.of("sense"):
            q, v = law.sense(world, q, v)
        world.error = command.target - q
        torque = gains.kp * world.error - gains.kd * v
        believed = gains.believed_kp * world.error - gains.believed_kd * v if self._unknown else torque
        if command.torque is not None:
            forward, believed = command.torque, believed + command.torque
            for law in now.of("feed_forward"):
                forward = law.feed_forward(world, forward)
            torque = torque + forward
        for law in now.of("drive"):
            torque = law.drive(world, torque)
        torque = np.clip(torque, -self.robot.limit, self.robot.limit)
        for law in now.of("saturate"):
            torque = law.saturate(world, torque)
        return believed, torque

    def _apply(self, now: Moving, torque: np.ndarray) -> None:
        """Let a torque (n, J) of the drives act on the mechanics."""
        world = now.world
        for law in now.of("transmit"):
            torque = law.transmit(world, torque)
        if self._acting["passive"]:
            torque = torque.copy()
            for law in now.of("passive"):
                law.passive(world, torque)
        self._push[now.rows, self._v] = torque
        if self._rub is not None:
            level = np.repeat(self.robot.friction[None], world.count, axis=0)
            for law in now.of("friction"):
                law.friction(world, level)
            self._rub[now.rows, self._v] = level
        if self._inertia is not None:
            armature = np.repeat(self.model.dof_armature[None, self._v], world.count, axis=0)
            for law in now.of("inertia"):
                law.inertia(world, armature)
            self._inertia[now.rows, self._v] = armature
        if self._acting["push"]:
            wrench = np.zeros((world.count, *self._wrench.shape[1:]))
            for law in now.of("push"):
                law.push(world, wrench)
            self._wrench[now.rows] = wrench


def _span(addresses: np.ndarray) -> slice:
    """Addresses that follow each other, as a slice."""
    assert np.array_equal(addresses, np.arange(addresses[0], addresses[0] + len(addresses)))
    return slice(int(addresses[0]), int(addresses[0]) + len(addresses))
