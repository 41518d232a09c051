"""The GPU engine with effects that the model alone does not carry; `sim.effects.cpu_engine` is the same on the CPU.

Hooks are written before every physics step: a CUDA graph of torch, then one of Warp, for each of the steps of a control
period. Play and flexible shafts add joints that no encoder reads; the map between the task's joints and the model's is
here.
"""

from collections.abc import Mapping

import mujoco
import numpy as np
import torch
from torch import Tensor

from bumblebee.sim.cuda_graph import Captured
from bumblebee.sim.effects.hooks import RuntimeHooks, hook_joints
from bumblebee.sim.effects.warp_hooks import WarpBatch, WarpHooks
from bumblebee.sim.engine import RobotState
from bumblebee.sim.mujoco_warp import MujocoWarp
from bumblebee.sim.rotations import from_rotation_vector, multiply, rotate_inverse
from bumblebee.sim.warp_limits import Buffers

_ROOT_Q, _ROOT_V = 7, 6


class EffectsWarp(MujocoWarp):
    """`MujocoWarp` with every effect of `effects.yaml`; the arguments are the same, and a seed of lost commands."""

    def __init__(
        self,
        model: mujoco.MjModel,
        num_worlds: int,
        control_hz: float = 50.0,
        hooks: RuntimeHooks | None = None,
        device: str = "cuda",
        buffers: Buffers | None = None,
        seed: int = 0,
    ) -> None:
        self._effects, self._running = hooks, None
        super().__init__(model, num_worlds, control_hz, hooks, device, buffers)
        joints = hook_joints(model)
        self._q = self._index([*range(_ROOT_Q), *model.jnt_qposadr[joints].tolist()])
        self._v = self._index([*range(_ROOT_V), *model.jnt_dofadr[joints].tolist()])
        self._rest = torch.as_tensor(model.qpos0, dtype=torch.float32, device=self.device)
        yields = [j for j in range(model.njnt) if model.jnt_plasticadr[j] >= 0]
        self._plastic = self._wp.to_torch(self._data.plastic)
        self._plastic_at = self._index([int(model.jnt_plasticadr[j]) for j in yields])
        self._plastic_q = self._index([int(model.jnt_qposadr[j]) for j in yields])
        self._last = self._ctrl.clone()
        self._generator = torch.Generator(self.device).manual_seed(seed)
        if hooks is not None:
            self._tilt = torch.as_tensor(hooks.imu, dtype=torch.float32, device=self.device)
            self._dropped = torch.as_tensor(hooks.dropped, dtype=torch.float32, device=self.device)
            self._batch = WarpBatch(self._wp, self._model, self._data, self.device)
            with self._wp.ScopedDevice(device):
                self._running = WarpHooks(hooks, model, self._batch)
            self._apply = Captured(self._running.apply, self.device)
        self._stand()

    def set_fields(self, fields: Mapping[str, np.ndarray]) -> None:
        """See `Engine.set_fields`; the hooks act upon the fields as they are then."""
        super().set_fields(fields)
        if self._running is not None:
            with self._wp.ScopedDevice(str(self.device)):
                self._running.refresh(fields)
            self._apply = Captured(self._running.apply, self.device)

    def reset(self, rows: Tensor, qpos: Tensor, qvel: Tensor, targets: Tensor) -> None:
        """See `Engine.reset`: joints that no encoder reads start at rest, springs that yield unloaded."""
        if rows.dtype == torch.bool and qpos.shape[1] != self.model.nq:
            full_q = self._rest.repeat(len(qpos), 1).index_copy(1, self._q, qpos)
            full_v = torch.zeros(len(qvel), self.model.nv, device=self.device).index_copy(1, self._v, qvel)
            qpos, qvel = full_q, full_v
        super().reset(rows, qpos, qvel, targets)
        if rows.dtype != torch.bool or not hasattr(self, "_last"):
            return
        chosen = rows[:, None]
        self._last.copy_(torch.where(chosen, targets, self._last))
        if len(self._plastic_at):
            unloaded = self._plastic.index_copy(1, self._plastic_at, self._qpos[:, self._plastic_q])
            self._plastic.copy_(torch.where(chosen, unloaded, self._plastic))
        if self._running is not None:
            self._running.restart(rows)

    def step(self, targets: Tensor) -> None:
        """See `Engine.step`; hooks are written before every physics step."""
        hooks = self._effects
        held = targets if hooks is None or not hooks.dropped.any() else self._arrived(hooks, targets)
        if hooks is None or not hooks.each_step:
            super().step(held)
            return
        self._ctrl.copy_(held)
        for left in reversed(range(self.substeps)):
            self._apply()
            self._run("inner", self._inner) if left else self._run("last", self._last_step)
        self._read_encoders()

    def _arrived(self, hooks: RuntimeHooks, targets: Tensor) -> Tensor:
        """The targets (B, J) with some of them lost: the one before is held."""
        shape = (len(targets), 1 if hooks.dropped_together else targets.shape[1])
        draw = torch.rand(shape, generator=self._generator, device=self.device)
        self._last.copy_(torch.where(draw < self._dropped, self._last, targets))
        return self._last

    def state(self) -> RobotState:
        """See `Engine.state`, as late, rounded and tilted as the sensors are; may be recorded."""
        qpos, qvel = self._qpos.clone(), self._qvel.clone()
        quat = seen = qpos[:, 3:7]
        joint_pos = qpos[:, self._q[_ROOT_Q:]]
        if self._running is not None and self._effects is not None:
            joint_pos = self._running.readings()
            if self._effects.imu.any():
                seen = multiply(quat, from_rotation_vector(self._tilt).expand_as(quat))
        return RobotState(
            root_pos_w=qpos[:, :3],
            root_quat_w=seen,
            root_lin_vel_b=rotate_inverse(quat, qvel[:, :3]),
            root_ang_vel_b=qvel[:, 3:6],
            joint_pos=joint_pos,
            joint_vel=qvel[:, self._v[_ROOT_V:]],
            key_pos_w=self._xpos.index_select(1, self._keys),
            read_key_pos_w=None if self._offset is None else self._believed_xpos.index_select(1, self._keys),
        )

    def _read_encoders(self) -> None:
        """Put the bodies of `_believed` where the encoders say that they are."""
        if self._offset is None or self._running is None:
            return
        self._believed_qpos.copy_(self._qpos.index_copy(1, self._q[_ROOT_Q:], self._running.readings()))
        self._run("read", lambda: self._mjw.kinematics(self._model, self._believed))

    def torque(self) -> Tensor:
        """See `Engine.torque`."""
        force = super().torque()
        if self._running is None or self._effects is None or not self._effects.each_step:
            return force
        return force + self._running.torques()

    def state_dict(self) -> dict[str, Tensor]:
        """All that the next step depends on, to go on later from here."""
        return super().state_dict() | {"generator": self._generator.get_state()}

    def load_state_dict(self, saved: dict[str, Tensor]) -> None:
        """Go on from what `state_dict` gave."""
        super().load_state_dict(saved)
        self._generator.set_state(saved["generator"])

    def _kept(self) -> dict[str, Tensor]:
        kept = super()._kept() | {"last": self._last, "plastic": self._plastic}
        if self._running is None:
            return kept
        return kept | {f"hook_{name}": tensor for name, tensor in self._running.own.items()}
