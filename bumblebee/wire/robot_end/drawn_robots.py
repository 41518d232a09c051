"""Robots that differ from the declared model as training's worlds do: masses, gains, friction, delays, pushes."""

import numpy as np
import torch

from bumblebee.policy.robots import CONTROL_HZ, NominalRobots
from bumblebee.robot.servo_command import ServoCommand
from bumblebee.sim.mujoco_cpu import history_template
from bumblebee.sim.sensors import load_spec
from bumblebee.sim.world_fields import MASSES
from bumblebee.tracking.config import Randomisation
from bumblebee.tracking.model import add_delays
from bumblebee.tracking.worlds.pushes import push_phase, regular_push
from bumblebee.tracking.worlds.randomisation import draw_fields


class DrawnRobots(NominalRobots):
    """Robots drawn from a randomisation, each the same after every reset; pushes are at regular intervals.

    Args:
        count: number of robots.
        randomisation: how far they may differ, and how hard and how often they are pushed.
        seed: of the draw.
        threads: of the simulation.
    """

    def __init__(self, count: int, randomisation: Randomisation, seed: int, threads: int = 1) -> None:
        spec = load_spec()
        add_delays(spec, randomisation)
        super().__init__(count, threads, spec.compile())
        fields = draw_fields(self.model, randomisation, count, seed)
        for name, values in fields.items():
            self.batch.expand(name)[:] = values
        if MASSES & set(fields):
            self.batch.set_const()
        self._randomisation, self._seed, self._dt = randomisation, seed, 1.0 / CONTROL_HZ
        self._template, self._held = history_template(self.model)

    def reset(self, qpos: np.ndarray, qvel: np.ndarray, targets: np.ndarray) -> None:
        """See `Robots.reset`; also fills the delayed commands, and begins the pushes anew."""
        super().reset(qpos, qvel, targets)
        if len(self._template):
            history = np.repeat(self._template[None], len(qpos), axis=0)
            for column, actuator in self._held:
                history[:, column] = targets[:, actuator]
            self.batch.history[:] = history
        self._clock = push_phase(self._randomisation, len(qpos), self._dt, torch.device("cpu"))
        self._generator = torch.Generator().manual_seed(self._seed)

    def step(self, robots: np.ndarray, command: ServoCommand) -> None:
        """Push those whose turn it is, and hold a command for 20 ms on `robots` (n,)."""
        self._clock += 1
        push = regular_push(self._randomisation, self._clock, self._dt, self._generator)
        self._view.qvel[robots, :3] += push[robots].numpy()
        super().step(robots, command)
