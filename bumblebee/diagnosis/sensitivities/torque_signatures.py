"""The torque that an effect would have put on the joints along a path, for one step of each of its parameters.

Signatures of the design note: sgn(v) for dry friction, v for viscous, exp(-(v/vs)^2) sgn(v) for Stribeck's, the
acceleration for an armature, the servo's own torque for its strength, and so on.
"""

import copy
from collections.abc import Sequence

import mujoco
import numpy as np

from bumblebee.diagnosis.candidates import Candidate
from bumblebee.diagnosis.sensitivities.impulse_responses import Path
from bumblebee.diagnosis.sensitivities.latency_signatures import LATE, Late
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
from bumblebee.sim.effects import SETPOINTS, Effect, bent, runtime_hooks, sloped, spread_inertia

_NO_SIGNATURE = '{} has no torque in sensitivities/torque_signatures.py: add it, or column="simulated" in traits.py'


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
        self.sign = np.tanh(self.v / rule.creep)
        memory = remember(plant, windows, runtime_hooks([], plant.model), path.step)
        order = [runtime_hooks([], plant.model).joints.index(name) for name in plant.joints]
        clock = memory.time[:, None] + path.step * np.arange(self.q.shape[1])
        self.clock = clock[..., None]
        self.heat = memory.heat[:, None, order]
        self._inverse: dict[tuple[str, int], np.ndarray] = {}
        self.late = Late(plant, windows, path, self.servos)

    def of(self, candidate: Candidate) -> np.ndarray:
        """Torques (F, W, S, nv) for one step of each of the F free parameters."""
        if candidate.effect.startswith("link_"):
            return self._inertial(candidate)
        if candidate.effect == "external_wrench":
            return self._wrench(candidate)
        if candidate.effect == "ground_slope":
            return self._slope(candidate)
        if candidate.where and candidate.where not in self.plant.joints:
            raise ValueError(_NO_SIGNATURE.format(candidate.effect))
        columns = [self.plant.joints.index(candidate.where)] if candidate.where else list(range(len(self.plant.joints)))
        parts = [self._joint(candidate, j) for j in columns]
        out = np.zeros((len(candidate.free), *self.path.mean(self.q).shape[:2], self.plant.model.nv))
        for j, torques in zip(columns, parts, strict=True):
            for f, torque in enumerate(torques):
                out[f, :, :, self.plant.dof[j]] += self.path.mean(torque)
        return out

    def _joint(self, c: Candidate, j: int) -> Sequence[np.ndarray]:
        """Torques (W, K) on joint j for one step of each free parameter."""
        q, v, step, servos = self.q[..., j], self.v[..., j], c.step, self.servos
        torque, sign = self.torque[..., j], self.sign[..., j]
        simple = {
            "coulomb_friction": lambda: -sign,
            "viscous_friction": lambda: -v,
            "quadratic_friction": lambda: -v * np.abs(v),
            "asymmetric_friction": lambda: np.full_like(q, -0.5),
            "armature": lambda: -self.a[..., j],
            "motor_strength": lambda: torque,
            "kp": lambda: torque - servos.bias[..., j, 2] * v,
            "kd": lambda: servos.bias[..., j, 2] * v,
            "strength_drift": lambda: -self.clock[..., 0] * torque,
            "thermal_fade": lambda: -self.heat[..., j] * torque,
        }
        if c.effect in simple:
            return [step[0] * simple[c.effect]()]
        if c.effect == "stribeck_friction":
            return [-step[0] * np.exp(-((v / step[1]) ** 2)) * sign]
        if c.effect == "load_dependent_friction":
            return [-step[0] * np.abs(torque) * sign, -0.5 * step[1] * np.abs(torque) * sign**2][: len(c.free)]
        if c.effect == "joint_spring":
            return [-step[0] * q, np.full_like(q, step[1])]
        if c.effect == "cogging":
            return [step[0] * np.sin(step[2] * q), step[1] * np.cos(step[2] * q)]
        if c.effect == "hysteresis":
            return [self._hysteresis(c, j)]
        if c.effect == "torque_limit":
            limit = c.start[0] * self.supply
            return [np.clip(torque, -limit, limit) - torque]
        if c.effect == "torque_speed_limit":
            left = servos.limit[..., j] * np.clip(1.0 - np.abs(v) * c.step[0] / self.supply, 0.0, 1.0)
            return [np.where(torque * v > 0, np.clip(torque, -left, left) - torque, 0.0)]
        if c.effect in LATE:
            return [self.late.torque(c.effect, c.start[0], self.torque)[..., j]]
        return [self._commanded(c, j)]

    def _hysteresis(self, c: Candidate, j: int) -> np.ndarray:
        width, q = c.step[1], self.q[..., j]
        if c.step[2]:
            z, out = bent_before(self.windows, j, width, self.plant.thresholds.path), np.empty_like(q)
            for k, path in enumerate(np.diff(q, axis=1, append=q[:, -1:]).T):
                out[:, k] = z
                z = bent(z, path, width)
            return -c.step[0] * out
        centre = yielded(self.windows, j, width, self.plant.thresholds.path)
        out = np.empty_like(q)
        for k in range(q.shape[1]):
            centre = np.clip(centre, q[:, k] - width, q[:, k] + width)
            out[:, k] = (q[:, k] - centre) / width
        return -c.step[0] * out

    def _commanded(self, c: Candidate, j: int) -> np.ndarray:
        """Delayed and lost commands of one joint, alone or with the others."""
        effect = c.at(np.array(c.nominal) + np.array(c.step))
        if c.effect in ("command_delay", "dropped_commands", *SETPOINTS):
            return self.servos.gain[..., j] * (self._moved_control(effect) - self._moved_control())[..., j]
        raise ValueError(_NO_SIGNATURE.format(c.effect))

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

    def _inertial(self, c: Candidate) -> np.ndarray:
        """Less inverse dynamics with the body's parameter moved than without."""
        body = self.plant.model.body(c.where).id
        name = {"link_mass": "body_mass", "link_com": "body_ipos", "link_inertia": "body_inertia"}[c.effect]
        base = self._inverse_dynamics(self.plant.model)
        out = []
        for f in c.free:
            model = self._copy()
            table = getattr(model, name)
            if c.effect == "link_mass":
                factor = 1 + c.step[f] / table[body]
                model.body_inertia[body] = spread_inertia(model.body_inertia[body], factor, c.start[1])
                table[body] *= factor
            else:
                table[body, f] += c.step[f]
            out.append(base - self._inverse_dynamics(model))
        return np.stack(out)

    def _slope(self, c: Candidate) -> np.ndarray:
        base = self._inverse_dynamics(self.plant.model)
        out = []
        for f in c.free:
            model, turn = self._copy(), [0.0, 0.0, 0.0]
            turn[f] = c.step[f]
            model.opt.gravity = sloped(model.opt.gravity, *turn)
            out.append(base - self._inverse_dynamics(model))
        return np.stack(out)

    def _copy(self) -> mujoco.MjModel:
        return copy.copy(self.plant.model)

    def _middles(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """State and acceleration (W, S, .) of whole segments: middle position, mean velocity and acceleration."""
        edges, path = self.path.edges, self.path
        acceleration = np.diff(path.qvel[:, edges], axis=1) / (path.step * np.diff(edges))[:, None]
        middle = (edges[:-1] + edges[1:]) // 2
        return path.qpos[:, middle], path.qvel[:, middle], acceleration

    def _inverse_dynamics(self, model: mujoco.MjModel) -> np.ndarray:
        """Generalised forces (W, S, nv) of rigid bodies alone: no contact, no friction, no servo."""
        if model is self.plant.model:
            if ("", 0) not in self._inverse:
                self._inverse["", 0] = self._inverse_dynamics(self._copy())
            return self._inverse["", 0]
        off = mujoco.mjtDisableBit
        model.opt.disableflags |= int(off.mjDSBL_CONSTRAINT) | int(off.mjDSBL_ACTUATION) | int(off.mjDSBL_SPRING)
        model.opt.disableflags |= int(off.mjDSBL_SENSOR)
        data = mujoco.MjData(model)
        q, v, a = (x.reshape(-1, x.shape[-1]) for x in self._middles())
        out = np.empty_like(v)
        for k in range(len(q)):
            data.qpos[:], data.qvel[:], data.qacc[:] = q[k], v[k], a[k]
            mujoco.mj_inverse(model, data)
            out[k] = data.qfrc_inverse
        return out.reshape(*self.path.mean(self.q).shape[:2], -1)

    def _wrench(self, c: Candidate) -> np.ndarray:
        """Jacobian of the body's centre of mass, transposed, times a force."""
        model, data = self.plant.model, mujoco.MjData(self.plant.model)
        body = model.body(c.where).id
        q = self._middles()[0]
        flat = q.reshape(-1, q.shape[-1])
        rows = np.empty((len(flat), 3, model.nv))
        linear, angular = np.empty((3, model.nv)), np.empty((3, model.nv))
        for k, pose in enumerate(flat):
            data.qpos[:] = pose
            mujoco.mj_kinematics(model, data)
            mujoco.mj_comPos(model, data)
            mujoco.mj_jacBodyCom(model, data, linear, angular, body)
            rows[k] = linear
        rows = rows.reshape(*q.shape[:2], 3, model.nv)
        return np.stack([c.step[f] * rows[:, :, f] for f in c.free])
