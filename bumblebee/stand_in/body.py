"""The stand-in robot's body: a G1 with undeclared laws behind the face of `bumblebee.policy.robots.Robots`.

Without effects it differs from the declared model by time step, integrator and servo discretisation only.
"""

import hashlib
from collections.abc import Sequence
from dataclasses import replace

import mujoco
import numpy as np

from bumblebee.policy.robots import BatchView
from bumblebee.robot.sensors import Sensors
from bumblebee.robot.servo_command import ServoCommand
from bumblebee.sim.sensors import add_foot_sensors
from bumblebee.stand_in.sealed import Json, declared_g1, to_laws
from bumblebee.stand_in.undeclared.law import Law
from bumblebee.stand_in.undeclared.simulation import CYCLES, TrueRobots


class StandInRobots:
    """Many copies of the stand-in.

    Args:
        count: number of robots.
        effects: entries of the sealed file, empty for none.
        more: laws of the world around it, such as a gantry's.
    """

    def __init__(self, count: int, effects: Sequence[Json], more: Sequence[Law] = ()) -> None:
        robot = declared_g1()
        spec = robot.spec.copy()
        add_foot_sensors(spec)
        for actuator in spec.actuators:
            actuator.set_to_motor()
        rng = np.random.default_rng(0)
        self._body = TrueRobots(replace(robot, spec=spec), [*to_laws(effects), *more], count, rng, solver=None)
        self.model: mujoco.MjModel = self._body.model
        self.batch, self.kp, self.kd = self._body.batch, self._body.kp, self._body.kd
        self._view = BatchView(self.batch)

    def reset(self, qpos: np.ndarray, qvel: np.ndarray, targets: np.ndarray) -> None:
        """Put all robots at qpos (B, 7 + J), qvel (B, 6 + J), as if targets (B, J) had long been held."""
        self._body.reset(qpos, qvel, targets)
        # What is left to chance follows from the start alone: the same episode is the same whatever runs beside.
        self._body.world.rng = [_chance(*start) for start in zip(qpos, qvel, strict=True)]
        self._body.settle(targets)

    def read(self) -> Sensors:
        """Readings of all robots without noise, with the sensors' faults and the drives' belief of their torque."""
        position, velocity = self._body.readings()
        true = self._view.sensors(self._body.reported)
        return replace(true, joint_pos=position, joint_vel=velocity, base_quat=self._body.orientation())

    def truth(self) -> Sensors:
        """See `Robots.truth`."""
        return self._view.sensors(self._body.reported)

    def step(self, robots: np.ndarray, command: ServoCommand, cycles: int = CYCLES) -> None:
        """Command the drives of `robots` (n,) for 20 ms: 20 servo cycles of 1 ms; the others stand still in time."""
        self._body.step(command, robots, cycles)

    def issued(self, command: ServoCommand) -> ServoCommand:
        """Command to all robots as it is after it was issued; `go_on` moves them under it."""
        return self._body.issued(command)

    def go_on(self, arrived: ServoCommand, cycles: int) -> None:
        """Let all robots move for some servo cycles of 1 ms under a command that has arrived."""
        self._body.go_on(arrived, cycles)


def _chance(qpos: np.ndarray, qvel: np.ndarray) -> np.random.Generator:
    digest = hashlib.sha256(np.concatenate((qpos, qvel)).tobytes()).digest()
    return np.random.default_rng(int.from_bytes(digest[:8], "little"))
