"""The torque that an effect would have put on the joints along a path, for one step of each of its parameters.

The effects themselves say which (`effects.kind.Kind.torque`): sgn(v) for dry friction, v for viscous, the acceleration
for an armature, the servo's own torque for its strength, and so on.
"""

import copy
from collections.abc import Callable, Sequence

import mujoco
import numpy as np

from bumblebee.diagnosis.candidates import Candidate
from bumblebee.diagnosis.sensitivities.impulse_responses import Path
from bumblebee.diagnosis.sensitivities.latency_signatures import Late
from bumblebee.diagnosis.simulation import (
    Plant,
    Variation,
    Windows,
    bent_before,
    inputs_of,
    remember,
    setpoints_of,
    window_servos,
    yielded,
)
from bumblebee.diagnosis.thresholds.sensitivities import TorqueSignatures
from bumblebee.sim.effects import CATALOGUE, Effect, bent, runtime_hooks


class Signatures:
    """Torques on the W windows' degrees of freedom, mean over each of S segments of their paths."""

    def __init__(
        self, plant: Plant, windows: Windows, variation: Variation, path: Path, rule: TorqueSignatures
    ) -> None:
        self.plant, self.windows, self.path, self._variation = plant, windows, path, variation
        self.servos = window_servos(plant, windows, variation.models)
        self.q = path.qpos[:, :-1, plant.qpos]
        self.v = path.qvel[:, :-1, plant.dof]
        self.a = np.diff(path.qvel[:, :, plant.dof], axis=1) / path.step
        self.supply = np.atleast_1d(self.servos.supply)[..., 0]
        self.u = self.servos.controls(path.control)
        self.torque = self.servos.torque(self.q, self.v, self.u)
        self._creep = rule.creep
        self.sign = self.direction(self.v)
        memory = remember(plant, windows, runtime_hooks([], plant.model), path.step)
        order = [runtime_hooks([], plant.model).joints.index(name) for name in plant.joints]
        clock = memory.time[:, None] + path.step * np.arange(self.q.shape[1])
        self.clock = clock[..., None]
        self.heat = memory.heat[:, None, order]
        self._inverse: dict[tuple[str, int], np.ndarray] = {}
        self.late = Late(plant, windows, path, self.servos)
        self._joints = [AlongJoint(self, j) for j in range(len(plant.joints))]

    def of(self, candidate: Candidate) -> np.ndarray:
        """Torques (F, W, S, nv) for one step of each of the F free parameters."""
        kind = CATALOGUE[candidate.effect]
        if kind.on != "joint" or kind.on_two_joints:
            return np.asarray(kind.torque(self, candidate))
        joints = self.plant.joints
        columns = [joints.index(candidate.where)] if candidate.where else list(range(len(joints)))
        parts = [kind.torque(self._joints[j], candidate) for j in columns]
        out = np.zeros((len(candidate.free), *self.path.mean(self.q).shape[:2], self.plant.model.nv))
        for j, torques in zip(columns, parts, strict=True):
            for f, torque in enumerate(torques):
                out[f, :, :, self.plant.dof[j]] += self.path.mean(torque)
        return out

    def direction(self, speed: np.ndarray) -> np.ndarray:
        """Sign of speeds [rad/s], smooth at rest."""
        return np.tanh(speed / self._creep)

    def inertial(self, free: Sequence[int], move: Callable[[mujoco.MjModel, int], None]) -> np.ndarray:
        """Less inverse dynamics (F, W, S, nv) with a parameter of `free` moved in a model than without."""
        base = self.inverse_dynamics(self.plant.model)
        out = []
        for f in free:
            model = copy.copy(self.plant.model)
            move(model, f)
            out.append(base - self.inverse_dynamics(model))
        return np.stack(out)

    def jacobians(self, body: str) -> np.ndarray:
        """Jacobian (W, S, 3, nv) of a body's centre of mass."""
        model, data = self.plant.model, mujoco.MjData(self.plant.model)
        index = model.body(body).id
        q = self.middles()[0]
        flat = q.reshape(-1, q.shape[-1])
        rows = np.empty((len(flat), 3, model.nv))
        linear, angular = np.empty((3, model.nv)), np.empty((3, model.nv))
        for k, pose in enumerate(flat):
            data.qpos[:] = pose
            mujoco.mj_kinematics(model, data)
            mujoco.mj_comPos(model, data)
            mujoco.mj_jacBodyCom(model, data, linear, angular, index)
            rows[k] = linear
        return rows.reshape(*q.shape[:2], 3, model.nv)

    def commanded(self, effect: Effect) -> np.ndarray:
        """Change of the controls (W, K, J) with delayed or lost commands, or with the effect's own set-points."""
        return self._moved_control(effect) - self._moved_control()

    def _moved_control(self, effect: Effect | None = None) -> np.ndarray:
        """Controls (W, K, J) with delayed or lost commands on all joints, or with the effect's own set-points.

        Without an effect those of the declared robot: the model's own may be late already by an effect that was found.
        """
        kind, value = (effect.effect, effect.value()) if effect else ("declared", 0.0)
        key = (kind, round(1e9 * value))
        shaped = setpoints_of(self.plant, [effect]) if effect else ()
        if key not in self._inverse or shaped:
            delay, dropped = self.plant.delay, None
            if kind == "dropped_commands":
                dropped = np.full(self.plant.model.nu, value)
            elif kind == "command_delay":
                delay = np.full(self.plant.model.nu, value)
            moved = Variation(self.plant.model, delay, self.plant.offset, setpoints=shaped, dropped=dropped)
            control = inputs_of(self.windows, moved, self.path.step, self.path.control.shape[1], {})
            self._inverse[key] = self.servos.controls(control)
        return self._inverse[key]

    def middles(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """State and acceleration (W, S, .) of whole segments: middle position, mean velocity and acceleration."""
        edges, path = self.path.edges, self.path
        acceleration = np.diff(path.qvel[:, edges], axis=1) / (path.step * np.diff(edges))[:, None]
        middle = (edges[:-1] + edges[1:]) // 2
        return path.qpos[:, middle], path.qvel[:, middle], acceleration

    def inverse_dynamics(self, model: mujoco.MjModel) -> np.ndarray:
        """Generalised forces (W, S, nv) of rigid bodies alone: no contact, no friction, no servo."""
        if model is self.plant.model:
            if ("", 0) not in self._inverse:
                self._inverse["", 0] = self._inverse_dynamics(self.plant.model)
            return self._inverse["", 0]
        return self._inverse_dynamics(model)

    def _inverse_dynamics(self, model: mujoco.MjModel) -> np.ndarray:
        off, model = mujoco.mjtDisableBit, copy.copy(model)
        model.opt.disableflags |= int(off.mjDSBL_CONSTRAINT) | int(off.mjDSBL_ACTUATION) | int(off.mjDSBL_SPRING)
        model.opt.disableflags |= int(off.mjDSBL_SENSOR)
        data = mujoco.MjData(model)
        q, v, a = (x.reshape(-1, x.shape[-1]) for x in self.middles())
        out = np.empty_like(v)
        for k in range(len(q)):
            data.qpos[:], data.qvel[:], data.qacc[:] = q[k], v[k], a[k]
            mujoco.mj_inverse(model, data)
            out[k] = data.qfrc_inverse
        return out.reshape(*self.path.mean(self.q).shape[:2], -1)


class AlongJoint:
    """One joint along the paths: what an effect on it may ask for; W windows of K steps."""

    def __init__(self, all_joints: Signatures, j: int) -> None:
        self._all, self._j = all_joints, j
        servos = all_joints.servos
        self.q = all_joints.q[..., j]
        """(W, K) position [rad]."""
        self.v = all_joints.v[..., j]
        """(W, K) velocity [rad/s]."""
        self.a = all_joints.a[..., j]
        """(W, K) acceleration [rad/s^2]."""
        self.torque = all_joints.torque[..., j]
        """(W, K) its servo's torque [N m]."""
        self.sign = all_joints.sign[..., j]
        """(W, K) direction of motion, smooth at rest."""
        self.clock = all_joints.clock[..., 0]
        """(W, K) time since the rollout began [s]."""
        self.heat = all_joints.heat[..., j]
        """(W, 1) integral of (torque / limit)^2 [s]."""
        self.damping = servos.bias[..., j, 2]
        """Torque of its servo for a unit of velocity [N m s/rad], negative."""
        self.limit = servos.limit[..., j]
        """The servo's largest torque [N m]."""
        self.supply = all_joints.supply
        """Supply voltage as a share of the nominal one."""

    def bent(self, width: float) -> np.ndarray:
        """Z (W, K) of Dahl's law with a width [rad]."""
        of = self._all
        z, out = bent_before(of.windows, self._j, width, of.plant.thresholds.path), np.empty_like(self.q)
        for k, path in enumerate(np.diff(self.q, axis=1, append=self.q[:, -1:]).T):
            out[:, k] = z
            z = bent(z, path, width)
        return out

    def yielded(self, width: float) -> np.ndarray:
        """Torque (W, K) of a spring of 1 N m that yields at a width [rad], as a share."""
        of = self._all
        centre, out = yielded(of.windows, self._j, width, of.plant.thresholds.path), np.empty_like(self.q)
        for k in range(self.q.shape[1]):
            centre = np.clip(centre, self.q[:, k] - width, self.q[:, k] + width)
            out[:, k] = (self.q[:, k] - centre) / width
        return out

    def late(self, kind: str, time: float) -> np.ndarray:
        """Torque (W, K) missing where all drives lag or read late by a time [s]."""
        return self._all.late.torque(kind, time, self._all.torque)[..., self._j]

    def commanded(self, c: Candidate) -> np.ndarray:
        """Torque (W, K) of the change that a candidate's first step makes of the commands."""
        moved = self._all.commanded(c.at(c.start))[..., self._j]
        return self._all.servos.gain[..., self._j] * moved
