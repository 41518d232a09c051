"""Gantry: a rope that holds the simulated robot by its pelvis until it carries itself."""

import numpy as np
from mujoco.batch import Batch

from bumblebee import quaternions
from bumblebee.stand_in.undeclared.law import Law, World

_PULL, _BRAKE = 13_000.0, 1_300.0  # N/m, N s/m: a G1 of 33 kg sinks by 2.5 cm
_TURN, _CALM = 400.0, 20.0  # N m/rad, N m s/rad
_PELVIS = 1  # body


class Gantry(Law):
    """Holds one robot's pelvis upright at a height that moves slowly, or lets go."""

    def __init__(self) -> None:
        self.holds = True
        """Whether the rope is tight."""
        self.place = np.zeros(3)
        """(3,) where the pelvis is drawn to [m, world]."""

    def tie(self, batch: Batch) -> None:
        """Name the robot; until then nothing is held."""
        self._qpos, self._qvel = batch.bind("qpos"), batch.bind("qvel")

    def take(self) -> None:
        """Take hold where the robot is."""
        self.holds, self.place = True, self._qpos[0, :3].copy()

    def push(self, world: World, wrench: np.ndarray) -> None:
        """Add the rope's force and torque."""
        if not self.holds:
            return
        quat, speed = quaternions.normalised(self._qpos[0, 3:7]), self._qvel[0, :6]
        upright = quaternions.heading(quat)
        error = quaternions.multiply(upright, quaternions.conjugate(quat))
        turn = 2.0 * np.sign(error[0]) * error[1:]
        wrench[0, _PELVIS, :3] += _PULL * (self.place - self._qpos[0, :3]) - _BRAKE * speed[:3]
        wrench[0, _PELVIS, 3:] += _TURN * turn - _CALM * quaternions.rotate(quat, speed[3:])
