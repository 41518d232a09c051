"""Many robots in MuJoCo behind one small face: put them somewhere, read them, hold a command for one tick."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import fields
from typing import Protocol

import mujoco
import numpy as np
from mujoco.batch import Batch

from bumblebee import quaternions
from bumblebee.robot.facts import joints as robot_joints
from bumblebee.robot.model import gains
from bumblebee.robot.sensors import Sensors
from bumblebee.robot.servo_command import ServoCommand
from bumblebee.sim.sensors import load_model

CONTROL_HZ = 50.0


class Robots(Protocol):
    """B robots on a floor, moved by commands to their drives at 50 Hz."""

    model: mujoco.MjModel

    def reset(self, qpos: np.ndarray, qvel: np.ndarray, targets: np.ndarray) -> None:
        """Put all robots at qpos (B, 7 + J), qvel (B, 6 + J), as if targets (B, J) had long been held."""

    def read(self) -> Sensors:
        """True readings of all B robots."""

    def truth(self) -> Sensors:
        """Readings of sensors without noise or faults, as motion capture would give: for judging, never for acting."""

    def step(self, robots: np.ndarray, command: ServoCommand) -> None:
        """Hold a command for one control period on `robots` (n,); the others stand still in time."""


class NominalRobots:
    """The declared model as it is trained on: position servos, 5 ms steps, no noise.

    Args:
        count: number of robots.
        threads: of the simulation.
        model: another G1 with position servos instead of the declared one, such as a corrected model; what its gains
            are in units of the declared ones, gains that a command brings are, too.
    """

    def __init__(self, count: int, threads: int = 2, model: mujoco.MjModel | None = None) -> None:
        self.model = load_model() if model is None else model
        self.batch = Batch(self.model, count, threads)
        self._steps = round(1.0 / CONTROL_HZ / self.model.opt.timestep)
        self._view = BatchView(self.batch)
        self._gains: tuple[np.ndarray, np.ndarray] | None = None  # (B, J, n) gain and bias, once a command changes them
        self._declared = np.array([gains(joint) for joint in robot_joints()])

    def reset(self, qpos: np.ndarray, qvel: np.ndarray, targets: np.ndarray) -> None:
        """Put all robots at qpos (B, 7 + J), qvel (B, 6 + J) with their servos at targets (B, J)."""
        self._view.reset(qpos, qvel)
        self._view.ctrl[:] = targets
        self.batch.forward()

    def read(self) -> Sensors:
        """True readings of all robots; torque and foot force are those of the last physics step."""
        return self._view.sensors(self._view.actuator_force)

    def truth(self) -> Sensors:
        """See `Robots.truth`: these sensors have no faults."""
        return self.read()

    def step(self, robots: np.ndarray, command: ServoCommand) -> None:
        """Hold a command for 20 ms on `robots` (n,)."""
        self.tell(robots, command)
        self.batch.step(ids=robots, nstep=self._steps)

    def tell(self, robots: np.ndarray, command: ServoCommand) -> None:
        """Give the servos of `robots` (n,) a command; its torque counts within their limits, as their own does."""
        self._set_gains(robots, command)
        control = command.target
        if command.torque is not None:
            gain = self.model.actuator_gainprm[:, 0] if self._gains is None else self._gains[0][robots, :, 0]
            control = control + command.torque / gain
        self._view.ctrl[robots] = control

    def _set_gains(self, robots: np.ndarray, command: ServoCommand) -> None:
        """Write the gains of the servos of `robots` (n,) in the model's fields, which each robot then has apart."""
        if self._gains is None:
            if command.kp is None and command.kd is None:
                return
            self._gains = self.batch.expand("actuator_gainprm"), self.batch.expand("actuator_biasprm")
        kp = 1.0 if command.kp is None else command.kp / self._declared[:, 0]
        kd = 1.0 if command.kd is None else command.kd / self._declared[:, 1]
        gain, bias, model = *self._gains, self.model
        gain[robots, :, 0] = kp * model.actuator_gainprm[:, 0]
        bias[robots, :, 0] = kp * model.actuator_biasprm[:, 0]  # what an encoder that is off does to the servo
        bias[robots, :, 1] = kp * model.actuator_biasprm[:, 1]
        bias[robots, :, 2] = kd * model.actuator_biasprm[:, 2]


class SideBySide:
    """Robots in equal parts, one thread a part, which meet once a control tick and not once a millisecond.

    Args:
        make: robots for a number of them.
        count: number of robots in all.
        threads: number of parts.
    """

    def __init__(self, make: Callable[[int], Robots], count: int, threads: int) -> None:
        # Every n-th robot goes to the same part, so that long and short clips are spread evenly.
        self._members = [np.arange(part, count, threads) for part in range(min(threads, count))]
        self._parts = [make(len(members)) for members in self._members]
        self._pool = ThreadPoolExecutor(len(self._parts))
        self._threads = threads
        self.model = self._parts[0].model

    def reset(self, qpos: np.ndarray, qvel: np.ndarray, targets: np.ndarray) -> None:
        """See `Robots.reset`."""
        for part, members in zip(self._parts, self._members, strict=True):
            part.reset(qpos[members], qvel[members], targets[members])

    def read(self) -> Sensors:
        """See `Robots.read`."""
        return self._gathered([part.read() for part in self._parts])

    def truth(self) -> Sensors:
        """See `Robots.truth`."""
        return self._gathered([part.truth() for part in self._parts])

    def _gathered(self, readings: list[Sensors]) -> Sensors:
        """The parts' readings in the robots' own order."""
        order = np.argsort(np.concatenate(self._members))
        return Sensors(
            **{f.name: np.concatenate([getattr(r, f.name) for r in readings])[order] for f in fields(Sensors)}
        )

    def step(self, robots: np.ndarray, command: ServoCommand) -> None:
        """See `Robots.step`."""
        jobs = []
        for number, part in enumerate(self._parts):
            own = robots % self._threads == number
            if own.any():
                jobs.append(self._pool.submit(part.step, robots[own] // self._threads, command[own]))
        for job in jobs:
            job.result()


class BatchView:
    """Live arrays of a batch of G1s (free base first, then the joints) and the readings made of them."""

    def __init__(self, batch: Batch) -> None:
        self._batch = batch
        self.qpos, self.qvel, self.ctrl = batch.bind("qpos"), batch.bind("qvel"), batch.bind("ctrl")
        self._warm, self._sensor = batch.bind("qacc_warmstart"), batch.bind("sensordata")
        self.actuator_force = batch.bind("actuator_force")

    def reset(self, qpos: np.ndarray, qvel: np.ndarray) -> None:
        """Write the state; nothing is left of what was before."""
        self._batch.reset()
        self.qpos[:], self.qvel[:], self._warm[:] = qpos, qvel, 0.0

    def sensors(self, joint_torque: np.ndarray) -> Sensors:
        """True readings, with the torque that the drives report, (B, J)."""
        quat = quaternions.normalised(self.qpos[:, 3:7])
        return Sensors(
            joint_pos=self.qpos[:, 7:].copy(),
            joint_vel=self.qvel[:, 6:].copy(),
            base_quat=quat,
            base_ang_vel=self.qvel[:, 3:6].copy(),
            base_lin_vel=quaternions.rotate(quaternions.conjugate(quat), self.qvel[:, :3]),
            base_pos=self.qpos[:, :3].copy(),
            joint_torque=joint_torque.copy(),
            # The sensor gives the force of the foot on the floor: the contract wants that of the floor on the foot.
            foot_force=-self._sensor[:, :6].reshape(-1, 2, 3),
        )
