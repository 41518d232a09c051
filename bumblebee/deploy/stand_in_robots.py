"""The stand-in robot's body: 1 ms semi-implicit Euler, a 1 kHz torque loop of its own, undeclared effects.

Without effects it differs from the declared model by time step, integrator and servo discretisation only. Dry friction
is MuJoCo's frictionloss (a constraint: it can hold a joint still); all else is computed here, in NumPy.
"""

import mujoco
import numpy as np
from mujoco.batch import Batch

from bumblebee.deploy.robots import CONTROL_HZ, BatchView
from bumblebee.deploy.sensors import Sensors
from bumblebee.deploy.stand_in_effects import STEP_MS, SealedEffects, to_arrays
from bumblebee.robot.facts import joints as robot_joints
from bumblebee.robot.model import RobotConfig, build_spec, gains
from bumblebee.sim.sensors import add_foot_sensors

SERVO_STEPS = round(1000 / CONTROL_HZ / STEP_MS)
# MuJoCo's default dry friction creeps (0.02 rad/s a N m at the knee) where a real joint sticks: made stiff here.
STICTION_SOLREF = (0.004, 1.0)
STICTION_SOLIMP = 0.999


class StandInRobots:
    """Many copies of the stand-in.

    Args:
        count: number of robots.
        effects: entries of the sealed file, empty for none.
    """

    def __init__(self, count: int, effects: list[dict]) -> None:
        self.model = _motor_model()
        self.effects = to_arrays(effects, self.model)
        _apply_to_model(self.model, self.effects)
        self.batch = Batch(self.model, count, 1)
        self._view = BatchView(self.batch)
        self._push = self.batch.bind("qfrc_applied")
        pairs = np.array([gains(joint) for joint in robot_joints()])
        self.kp, self.kd = pairs[:, 0], pairs[:, 1]
        self.limit = np.array([joint.effort_limit for joint in robot_joints()])
        self._reported = np.zeros((count, len(self.kp)))
        self._depth = int(self.effects.delay_ms.max()) + 1
        self._sent = np.zeros((self._depth, count, len(self.kp)))  # ring of past commands, one a millisecond
        self._clock = 0

    def reset(self, qpos: np.ndarray, qvel: np.ndarray, targets: np.ndarray) -> None:
        """Put all robots at qpos (B, 7 + J), qvel (B, 6 + J), as if targets (B, J) had long been held."""
        self._view.reset(qpos, qvel)
        self._sent[:] = targets
        self._push[:] = 0.0
        everyone = np.arange(len(qpos))
        self._servo(everyone, targets)
        self.batch.forward()

    def read(self) -> Sensors:
        """Readings of all robots without noise, with the encoders' offset and the drives' belief of their torque."""
        true = self._view.sensors(self._reported)
        return Sensors(**{**vars(true), "joint_pos": true.joint_pos + self.effects.offset})

    def step(self, robots: np.ndarray, targets: np.ndarray, cycles: int = SERVO_STEPS) -> None:
        """Hold targets (n, J) [rad] for 20 ms on `robots` (n,): 20 servo cycles of 1 ms."""
        rows = np.arange(len(self.kp))
        for _ in range(cycles):
            self._clock += 1
            self._sent[self._clock % self._depth, robots] = targets
            late = (self._clock - self.effects.delay_ms.astype(int)) % self._depth  # (J,)
            arrived = self._sent[late[:, None], robots[None], rows[:, None]].T  # (n, J)
            self._servo(robots, arrived)
            self.batch.step(ids=robots)

    def _servo(self, robots: np.ndarray, targets: np.ndarray) -> None:
        """One cycle of the drives: PD on what the encoders say, a weak motor gives less than the drive believes."""
        position = self._view.qpos[robots, 7:] + self.effects.offset
        velocity = self._view.qvel[robots, 6:]
        asked = self.kp * (targets - position) - self.kd * velocity
        self._view.ctrl[robots] = np.clip(self.effects.strength * asked, -self.limit, self.limit)
        self._push[robots, 6:] = -self.effects.viscous * velocity
        self._reported[robots] = np.clip(asked, -self.limit, self.limit)


def _motor_model() -> mujoco.MjModel:
    """The declared geometry and masses with torque motors, 1 ms steps and the semi-implicit Euler integrator."""
    spec = build_spec(RobotConfig(timestep=STEP_MS / 1000))
    add_foot_sensors(spec)
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_EULER
    for actuator in spec.actuators:
        actuator.set_to_motor()
    return spec.compile()


def _apply_to_model(model: mujoco.MjModel, effects: SealedEffects) -> None:
    model.dof_frictionloss[6:] += effects.coulomb
    if effects.coulomb.any():
        model.dof_solref[6:], model.dof_solimp[6:, :2] = STICTION_SOLREF, STICTION_SOLIMP
        # The declared model's 5 Newton iterations of 6 line-search steps do not converge on dry friction.
        model.opt.iterations = model.opt.ls_iterations = 50
    for dof, armature in effects.armature.items():
        model.dof_armature[dof] = armature
    for body, mass in effects.mass.items():
        model.body_mass[body] = mass  # a load at the link's centre of mass: its inertia stays
    mujoco.mj_setConst(model, mujoco.MjData(model))
