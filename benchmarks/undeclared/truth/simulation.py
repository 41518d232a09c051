"""A robot as it is: 1 ms semi-implicit Euler, torque motors, a servo loop of its own at 1 kHz, and laws.

The mechanics take shorter steps under the same torque where a law needs them (`Law.parts`).
Dry friction is MuJoCo's constraint (it can hold a joint still) made stiff, its level written every millisecond; all
other torques are computed here in NumPy.
"""

from collections.abc import Sequence

import mujoco
import numpy as np
from mujoco.batch import Batch

from benchmarks.undeclared.robots import Declared
from benchmarks.undeclared.truth.law import Law, World

STEP = 0.001  # [s]
CYCLES = 20  # of 1 ms in a control period of 20 ms
_STIFF = (0.004, 1.0), (0.999, 0.999)  # solref and solimp of dry friction


class TrueRobots:
    """R copies of one true robot side by side.

    Args:
        robot: what is declared of it.
        laws: what is not.
        count: R.
        rng: of what is random in the truth.
        parts: steps of the mechanics in a millisecond, at least.
    """

    def __init__(
        self, robot: Declared, laws: Sequence[Law], count: int, rng: np.random.Generator, parts: int = 1
    ) -> None:
        self.robot, self.laws = robot, sorted(laws, key=lambda law: not law.first)
        self._parts = max((law.parts for law in self.laws), default=1)
        self._parts = max(self._parts, parts)
        self.model = _true_model(robot, self.laws, STEP / self._parts)
        self.kp, self.kd = robot.kp.copy(), robot.kd.copy()
        for law in self.laws:
            law.gains(self.kp, self.kd)
        ids = [self.model.joint(name).id for name in robot.joints]
        self._q, self._v = self.model.jnt_qposadr[ids], self.model.jnt_dofadr[ids]
        self.world = World(robot.joints, count, STEP, rng)
        self._batch = Batch(self.model, count, 1)
        self._qpos, self._qvel = self._batch.bind("qpos"), self._batch.bind("qvel")
        self._push = self._batch.bind("qfrc_applied")
        self._wrench = self._batch.bind("xfrc_applied")
        self._rub = self._batch.expand("dof_frictionloss") if self._has("friction") else None
        self._inertia = self._batch.expand("dof_armature") if self._has("inertia") else None
        self._pushing = self._has("push")
        self.everyone = np.arange(count)

    def reset(self, qpos: np.ndarray, qvel: np.ndarray, target: np.ndarray) -> None:
        """Put all robots at qpos (R, nq), qvel (R, nv) of the declared model, `target` (R, J) long held."""
        self._batch.reset()
        self._qpos[:], self._qvel[:] = self.model.qpos0, 0.0
        self._qpos[:, self._q], self._qvel[:, self._v] = qpos[:, -len(self.kp) :], qvel[:, -len(self.kp) :]
        if self.robot.floating:
            self._qpos[:, :7], self._qvel[:, :6] = qpos[:, :7], qvel[:, :6]
        self._batch.bind("qacc_warmstart")[:] = 0.0
        self._push[:] = self._wrench[:] = 0.0
        self.world.time = 0.0
        self.world.torque = np.zeros_like(target)
        self._see()
        for law in self.laws:
            law.start(self.world, target)

    def resume(self, qpos: np.ndarray, qvel: np.ndarray, torque: np.ndarray, time: np.ndarray) -> None:
        """Go on from states (R, nq'), (R, nv') of this very model after `time` (R,); the laws remember already."""
        self._batch.reset()
        self._qpos[:], self._qvel[:] = qpos, qvel
        self._batch.bind("qacc_warmstart")[:] = 0.0
        self._push[:] = self._wrench[:] = 0.0
        self.world.time, self.world.torque = time, torque.copy()
        self._see()

    def own_state(self) -> tuple[np.ndarray, np.ndarray]:
        """The model's own state, (R, nq'), (R, nv')."""
        return self._qpos.copy(), self._qvel.copy()

    def state(self) -> tuple[np.ndarray, np.ndarray]:
        """What perfect sensors with this robot's faults would say, as (R, nq), (R, nv) of the declared model."""
        q, v = self._qpos[:, self._q].copy(), self._qvel[:, self._v].copy()
        for law in self.laws:
            q, v = law.read(self.world, q, v)
        if not self.robot.floating:
            return q, v
        quat = self._qpos[:, 3:7] / np.linalg.norm(self._qpos[:, 3:7], axis=1, keepdims=True)
        for law in self.laws:
            quat = law.base(quat)
        return np.concatenate((self._qpos[:, :3], quat, q), axis=1), np.concatenate((self._qvel[:, :6], v), axis=1)

    @property
    def torque(self) -> np.ndarray:
        """Torque of the drives in the last millisecond, (R, J) [N m]."""
        return self.world.torque

    def step(self, target: np.ndarray, robots: np.ndarray | None = None) -> None:
        """Hold `target` (R, J) [rad] for one control period; only `robots` move, all by default."""
        self.hold(self.arrived(target), robots)

    def arrived(self, target: np.ndarray) -> np.ndarray:
        """What becomes of `target` (R, J) [rad] when it is issued."""
        for law in self.laws:
            target = law.tick(self.world, target)
        return target

    def hold(self, arrived: np.ndarray, robots: np.ndarray | None = None) -> None:
        """Hold what has arrived for one control period."""
        robots = self.everyone if robots is None else robots
        for _ in range(CYCLES):
            self._cycle(arrived, robots)

    def _has(self, method: str) -> bool:
        return any(getattr(type(law), method) is not getattr(Law, method) for law in self.laws)

    def _see(self) -> None:
        self.world.q, self.world.v = self._qpos[:, self._q].copy(), self._qvel[:, self._v].copy()

    def _cycle(self, target: np.ndarray, robots: np.ndarray) -> None:
        world = self.world
        self._see()
        q, v, command = world.q, world.v, target
        for law in self.laws:
            command = law.command(world, command)
            q, v = law.sense(world, q, v)
        world.error = command - q
        torque = self.kp * world.error - self.kd * v
        for law in self.laws:
            torque = law.drive(world, torque)
        torque = np.clip(torque, -self.robot.limit, self.robot.limit)
        for law in self.laws:
            torque = law.saturate(world, torque)
        world.torque = torque
        world.dt = STEP / self._parts
        for part in range(self._parts):
            if part:
                self._see()
            self._move(torque, robots)
            world.time = world.time + world.dt
        world.dt = STEP

    def _move(self, torque: np.ndarray, robots: np.ndarray) -> None:
        """One step of the mechanics under the drives' torque (R, J)."""
        world = self.world
        for law in self.laws:
            torque = law.transmit(world, torque)
        push = torque.copy()
        for law in self.laws:
            law.passive(world, push)
        self._push[np.ix_(self.everyone, self._v)] = push
        if self._rub is not None:
            level = np.tile(self.robot.friction, (world.count, 1))
            for law in self.laws:
                law.friction(world, level)
            self._rub[np.ix_(self.everyone, self._v)] = level
        if self._inertia is not None:
            armature = np.tile(self.model.dof_armature[self._v], (world.count, 1))
            for law in self.laws:
                law.inertia(world, armature)
            self._inertia[np.ix_(self.everyone, self._v)] = armature
        if self._pushing:
            self._wrench[:] = 0.0
            for law in self.laws:
                law.push(world, self._wrench)
        self._batch.step(ids=robots)


def _true_model(robot: Declared, laws: Sequence[Law], step: float) -> mujoco.MjModel:
    spec = robot.spec.copy()
    for law in laws:
        law.spec(spec)
    for key in list(spec.keys):
        spec.delete(key)
    spec.option.timestep, spec.option.integrator = step, mujoco.mjtIntegrator.mjINT_EULER
    spec.option.iterations = spec.option.ls_iterations = 50
    spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)
    model = spec.compile()
    dofs = [model.joint(name).dofadr[0] for name in robot.joints]
    if any(type(law).friction is not Law.friction for law in laws):
        model.dof_solref[dofs], model.dof_solimp[dofs, :2] = _STIFF
    for law in sorted(laws, key=lambda law: not law.first):
        law.model(model)
    mujoco.mj_setConst(model, mujoco.MjData(model))
    return model
