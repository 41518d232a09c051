"""The CPU engine with effects that the model alone does not carry: step hooks, encoders' faults, play and shafts.

Play and flexible shafts add joints that no encoder reads; the map between the task's joints and the model's is here.
"""

from collections.abc import Mapping
from dataclasses import replace

import mujoco
import numpy as np
import torch
from torch import Tensor

from bumblebee.sim.effects.forces import StepHooks
from bumblebee.sim.effects.hooks import RuntimeHooks, hook_joints
from bumblebee.sim.engine import RobotState
from bumblebee.sim.mujoco_cpu import MujocoCpu
from bumblebee.sim.rotations import from_rotation_vector, multiply, rotate_inverse

_ROOT_Q, _ROOT_V = 7, 6


def needs_effects(model: mujoco.MjModel, hooks: RuntimeHooks | None) -> bool:
    """Whether `MujocoCpu` alone would leave something out."""
    hidden = model.nq != _ROOT_Q + len(hook_joints(model))
    yields = bool((model.jnt_plasticadr >= 0).any())
    return hidden or yields or (hooks is not None and not hooks.only_offsets)


class EffectsCpu(MujocoCpu):
    """`MujocoCpu` with every effect of `effects.yaml`; the arguments are the same."""

    def __init__(
        self,
        model: mujoco.MjModel,
        num_worlds: int,
        control_hz: float = 50.0,
        threads: int = 2,
        hooks: RuntimeHooks | None = None,
        seed: int = 0,
    ) -> None:
        super().__init__(model, num_worlds, control_hz, threads, hooks)
        joints = hook_joints(model)
        self._q = np.concatenate((np.arange(_ROOT_Q), model.jnt_qposadr[joints])).astype(int)
        self._v = np.concatenate((np.arange(_ROOT_V), model.jnt_dofadr[joints])).astype(int)
        self._effects = hooks
        self._running = StepHooks(hooks, model, self.batch) if hooks is not None else None
        self._plastic = [j for j in range(model.njnt) if model.jnt_plasticadr[j] >= 0]
        self._rng = np.random.default_rng(seed)
        self._last = np.zeros((num_worlds, model.nu))

    def set_fields(self, fields: Mapping[str, np.ndarray]) -> None:
        """See `Engine.set_fields`; the hooks act upon the fields as they are then."""
        super().set_fields(fields)
        if self._running is not None:
            self._running.rebase(fields)

    def reset(self, rows: Tensor, qpos: Tensor, qvel: Tensor, targets: Tensor) -> None:
        """See `Engine.reset`: joints that no encoder reads start at rest, springs that yield unloaded."""
        full_q = np.tile(self.model.qpos0, (len(qpos), 1))
        full_v = np.zeros((len(qvel), self.model.nv))
        full_q[:, self._q], full_v[:, self._v] = qpos.numpy(), qvel.numpy()
        super().reset(rows, torch.from_numpy(full_q), torch.from_numpy(full_v), targets)
        ids = (rows.nonzero()[:, 0] if rows.dtype == torch.bool else rows).numpy()
        if not len(ids):
            return
        for j in self._plastic:
            self.batch.bind("plastic")[ids, self.model.jnt_plasticadr[j]] = self.batch.qpos[
                ids, self.model.jnt_qposadr[j]
            ]
        self._last[ids] = self.batch.ctrl[ids]
        if self._running is not None:
            self._running.reset(ids)

    def step(self, targets: Tensor) -> None:
        """See `Engine.step`; hooks are written before every physics step."""
        hooks = self._effects
        if hooks is None or self._running is None or not (hooks.each_step or hooks.dropped.any()):
            super().step(targets)
            return
        held = torch.from_numpy(self._arrived(hooks, targets.numpy()))
        if not hooks.each_step:
            super().step(held)
            return
        self.batch.ctrl[:] = held.numpy()
        for _ in range(self.substeps - 1):
            self._running.apply()
            self.batch.step()
        self._running.apply()
        substeps, self.substeps = self.substeps, 1
        super().step(held)
        self.substeps = substeps

    def _arrived(self, hooks: RuntimeHooks, targets: np.ndarray) -> np.ndarray:
        """The targets (B, J) with some of them lost: the one before is held."""
        if hooks.dropped.any():
            draw = self._rng.random((len(targets), 1 if hooks.dropped_together else targets.shape[1]))
            targets = np.where(draw < hooks.dropped, self._last, targets)
        self._last = np.array(targets)
        return self._last.copy()

    def state(self) -> RobotState:
        """See `Engine.state`, as late, rounded and tilted as the sensors are."""
        quat = torch.from_numpy(self.batch.qpos[:, 3:7].astype(np.float32))
        speed = torch.from_numpy(self.batch.qvel[:, :3].astype(np.float32))
        state = super().state()
        read = self._read_qpos()[:, self._q]
        if self._effects is not None and self._effects.imu.any():
            tilt = torch.from_numpy(self._effects.imu.astype(np.float32))
            state = replace(state, root_quat_w=multiply(quat, from_rotation_vector(tilt).expand_as(quat)))
        return replace(
            state,
            root_lin_vel_b=rotate_inverse(quat, speed),
            joint_pos=torch.from_numpy(read[:, _ROOT_Q:].astype(np.float32)),
            joint_vel=torch.from_numpy(self.batch.qvel[:, self._v[_ROOT_V:]].astype(np.float32)),
        )

    def _read_qpos(self) -> np.ndarray:
        """Positions (B, nq) with the encoders' readings in place of the joints' own."""
        read = np.array(self.batch.qpos)
        if self._running is not None:
            read[:, self._q[_ROOT_Q:]] = self._running.read()
        if self._offset is not None:
            self._believed.find(read)
        return read

    def torque(self) -> Tensor:
        """See `Engine.torque`."""
        force = super().torque()
        if self._running is None or self._effects is None or not self._effects.each_step:
            return force
        return force + torch.from_numpy(self._running.applied.astype(np.float32))

    def state_dict(self) -> dict[str, np.ndarray]:
        """All that the next step depends on, to go on later from here."""
        hooks = {} if self._running is None else self._running.state_dict()
        return super().state_dict() | {"last": self._last.copy()} | {f"hook_{k}": v for k, v in hooks.items()}

    def load_state_dict(self, saved: dict[str, np.ndarray]) -> None:
        """Go on from what `state_dict` gave."""
        super().load_state_dict(saved)
        self._last[:] = saved["last"]
        if self._running is not None:
            self._running.load_state_dict({k[5:]: v for k, v in saved.items() if k.startswith("hook_")})
