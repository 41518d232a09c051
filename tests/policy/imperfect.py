"""A G1 that hangs by its pelvis and has effects: the declared model with `sim.effects` in it, hooks included."""

from collections.abc import Sequence
from dataclasses import replace

import mujoco
import numpy as np

from bumblebee import quaternions
from bumblebee.policy.robots import NominalRobots
from bumblebee.robot.sensors import Sensors
from bumblebee.robot.servo_command import ServoCommand
from bumblebee.sim.effects import Effect, StepHooks, add_to_spec, runtime_hooks
from bumblebee.sim.mujoco_cpu import history_template
from bumblebee.sim.sensors import load_spec

HEIGHT = 2.0  # m: of the pelvis


def hanging(effects: Sequence[Effect]) -> mujoco.MjModel:
    """The G1 with its pelvis held, and with the effects that MJCF carries."""
    spec = load_spec()
    spec.add_equality(
        type=mujoco.mjtEq.mjEQ_WELD,
        objtype=mujoco.mjtObj.mjOBJ_BODY,
        name1="pelvis",
        solref=[0.01, 1.0],
        data=[0, 0, 0, 0, 0, -HEIGHT, 1, 0, 0, 0, 1, 0],  # anchor, place of the world in the pelvis, torque scale
    )
    spec.option.iterations = spec.option.ls_iterations = 30
    add_to_spec(spec, effects)
    return spec.compile()


class Imperfect(NominalRobots):
    """`NominalRobots` that hang, with effects; all robots step together."""

    def __init__(self, effects: Sequence[Effect], count: int = 1) -> None:
        super().__init__(count, 1, hanging(effects))
        self._hooks = runtime_hooks(effects, self.model)
        self._running = StepHooks(self._hooks, self.model, self.batch)

    def reset(self, qpos: np.ndarray, qvel: np.ndarray, targets: np.ndarray) -> None:
        """As `NominalRobots`, the delays filled with what was held."""
        super().reset(qpos, qvel, targets)
        template, held = history_template(self.model)
        if len(template):
            filled = np.repeat(template[None], len(qpos), axis=0)
            for columns, actuators in held:
                filled[:, columns] = targets[:, actuators]
            self.batch.history[:] = filled
        self._running.reset(np.arange(len(qpos)))

    def read(self) -> Sensors:
        """Readings of the sensors."""
        true = super().read()
        angle = float(np.linalg.norm(self._hooks.imu))
        quat = true.base_quat
        if angle:
            quat = quaternions.multiply(quat, quaternions.from_axis_angle(self._hooks.imu / angle, angle))
        return replace(true, joint_pos=self._running.read(), base_quat=quat)

    def angles(self) -> np.ndarray:
        """True joint angles (B, J)."""
        return super().read().joint_pos

    def step(self, robots: np.ndarray, command: ServoCommand) -> None:
        """As `NominalRobots`, hooks before every physics step."""
        self.tell(robots, command)
        for _ in range(self._steps):
            self._running.apply()
            self.batch.step(ids=robots)
