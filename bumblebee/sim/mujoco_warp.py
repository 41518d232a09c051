"""The GPU engine: MuJoCo Warp, thousands of worlds on one CUDA device, seen through `sim.engine.Engine`.

The physics of a control period is one CUDA graph; Warp's arrays are torch's tensors without a copy. On Warp's own CPU
device, without graphs and slowly, it does the same, which is how the tests compare it with MuJoCo.
"""

from collections.abc import Callable, Mapping
from typing import Any

import mujoco
import numpy as np
import torch
from torch import Tensor

from bumblebee.errors import BadInput
from bumblebee.robot.facts import FEET, KEY_BODIES
from bumblebee.sim.effects import RuntimeHooks
from bumblebee.sim.engine import RobotState
from bumblebee.sim.mujoco_cpu import foot_sensor_columns, history_template, substeps_of
from bumblebee.sim.rotations import rotate_inverse
from bumblebee.sim.warp_limits import Buffers, fitting, overflow_line, warp_modules
from bumblebee.sim.world_fields import with_constants

_LARGEST = 1e10  # as in MuJoCo: a state beyond it, or no number, is bad


class MujocoWarp:
    """An `Engine` of `num_worlds` copies of `model` on a GPU.

    Args:
        model: free base first, then hinges with one position servo each, and the foot sensors of `sim.sensors`.
        num_worlds: how many robots.
        control_hz: rate of the policy; a whole number of physics steps must fit.
        hooks: effects outside the model, see `bumblebee.sim.effects.runtime_hooks`; here the encoders' offset alone,
            the others are those of `sim.effects.warp_engine.EffectsWarp`.
        device: a CUDA device ("cuda", "cuda:1"), or "cpu".
        buffers: room for contacts and constraints.

    Raises:
        BadInput: without the packages, the device, a driver that records graphs, or the memory, and for a model that
            MuJoCo Warp cannot simulate.
    """

    by_mask = True

    def __init__(
        self,
        model: mujoco.MjModel,
        num_worlds: int,
        control_hz: float = 50.0,
        hooks: RuntimeHooks | None = None,
        device: str = "cuda",
        buffers: Buffers | None = None,
    ) -> None:
        self._wp, self._mjw = warp_modules(device)
        self.model, self.num_worlds, self.control_dt = model, num_worlds, 1.0 / control_hz
        self.device = torch.device(device)
        self.substeps = substeps_of(model, control_hz)
        self.buffers = buffers or Buffers()
        with self._wp.ScopedDevice(device):
            self._model = self._put(model)
            self._model.opt.warn_overflow = 0  # counted in `_data.overflow` instead of printed by the thousand
            self._data = fitting(model, num_worlds, self.buffers, device)
        self._offset: Tensor | None = None
        if hooks is not None and np.any(hooks.encoder_offset):
            self._offset = torch.as_tensor(hooks.encoder_offset, dtype=torch.float32, device=self.device)
            with self._wp.ScopedDevice(device):
                self._believed = self._mjw.make_data(model, num_worlds, nconmax=1, njmax=1)
        self._bind()
        self._keys = self._index([model.body(name).id for name in KEY_BODIES])
        self._feet = self._index([model.body(name).id for name in FEET])
        self._force = self._index(foot_sensor_columns(model))
        template, held = history_template(model)
        self._history_start = torch.as_tensor(template, dtype=torch.float32, device=self.device)
        self._held_columns = self._index([c for columns, _ in held for c in range(columns.start, columns.stop)])
        self._held_motors = self._index([m for columns, motor in held for m in motor * (columns.stop - columns.start)])
        self._graphs: dict[str, Any] = {}
        self._seen: set[str] = set()
        self._stand()

    def set_fields(self, fields: Mapping[str, np.ndarray]) -> None:
        """See `Engine.set_fields`."""
        with self._wp.ScopedDevice(str(self.device)):
            for name, values in with_constants(self.model, fields).items():
                old = getattr(self._model, name)
                own = np.ascontiguousarray(values, dtype=np.float32)
                setattr(self._model, name, self._wp.array(own, dtype=old.dtype))
        self._graphs.clear()  # they hold the addresses of the old fields

    def reset(self, rows: Tensor, qpos: Tensor, qvel: Tensor, targets: Tensor) -> None:
        """See `Engine.reset`; with a mask nothing here waits for the device."""
        if rows.dtype != torch.bool:
            mask = torch.zeros(self.num_worlds, dtype=torch.bool, device=self.device)
            mask[rows] = True
            spread = [torch.zeros(self.num_worlds, v.shape[1], device=self.device) for v in (qpos, qvel, targets)]
            for whole, some in zip(spread, (qpos, qvel, targets), strict=True):
                whole[rows] = some
            self.reset(mask, *spread)
            return
        chosen = rows[:, None]
        for tensor, values in ((self._qpos, qpos), (self._qvel, qvel), (self._ctrl, targets)):
            tensor.copy_(torch.where(chosen, values, tensor))
        for tensor in (self._warmstart, self._act, self._actuator_force, self._sensordata):
            tensor.masked_fill_(chosen, 0.0)
        self._time.masked_fill_(rows, 0.0)
        if len(self._history_start):
            fresh = self._history_start.expand(self.num_worlds, -1).clone()
            fresh[:, self._held_columns] = targets[:, self._held_motors]
            self._history.copy_(torch.where(chosen, fresh, self._history))

    def settle(self) -> None:
        """See `Engine.settle`."""
        self._run("settle", self._kinematics)
        self._read_encoders()

    def step(self, targets: Tensor) -> None:
        """See `Engine.step`."""
        self._ctrl.copy_(targets)
        self._run("advance", self._advance)
        self._read_encoders()

    def state(self) -> RobotState:
        """See `Engine.state`; may be recorded."""
        qpos, qvel = self._qpos.clone(), self._qvel.clone()
        quat = qpos[:, 3:7]
        joint_pos = qpos[:, 7:]
        return RobotState(
            root_pos_w=qpos[:, :3],
            root_quat_w=quat,
            root_lin_vel_b=rotate_inverse(quat, qvel[:, :3]),
            root_ang_vel_b=qvel[:, 3:6],
            joint_pos=joint_pos if self._offset is None else joint_pos + self._offset,
            joint_vel=qvel[:, 6:],
            key_pos_w=self._xpos.index_select(1, self._keys),
            read_key_pos_w=None if self._offset is None else self._believed_xpos.index_select(1, self._keys),
        )

    def torque(self) -> Tensor:
        """See `Engine.torque`."""
        return self._actuator_force.clone()

    def foot_force_w(self) -> Tensor:
        """See `Engine.foot_force_w`."""
        return -self._sensordata.index_select(1, self._force).unflatten(1, (2, 3))

    def foot_quat_w(self) -> Tensor:
        """See `Engine.foot_quat_w`."""
        return self._xquat.index_select(1, self._feet)

    def push(self, velocity_w: Tensor) -> None:
        """See `Engine.push`."""
        self._qvel[:, :3] += velocity_w

    def unstable(self) -> Tensor:
        """See `Engine.unstable`; may be recorded."""
        good = (self._qpos.abs() < _LARGEST).all(-1) & (self._qvel.abs() < _LARGEST).all(-1)
        return ~good

    def check(self) -> None:
        """See `Engine.check`: waits for the device."""
        if line := overflow_line(self._data.overflow.numpy(), self.buffers):
            raise line

    def state_dict(self) -> dict[str, Tensor]:
        """All that the next step depends on, to go on later from here."""
        return {name: tensor.clone().cpu() for name, tensor in self._kept().items()}

    def load_state_dict(self, saved: dict[str, Tensor]) -> None:
        """Go on from what `state_dict` gave."""
        for name, tensor in self._kept().items():
            tensor.copy_(saved[name])
        self.settle()

    def _kept(self) -> dict[str, Tensor]:
        names = ("time", "qpos", "qvel", "ctrl", "act", "history", "warmstart", "actuator_force", "sensordata")
        return {name: getattr(self, f"_{name}") for name in names}

    def _put(self, model: mujoco.MjModel) -> Any:
        try:
            return self._mjw.put_model(model)
        except (NotImplementedError, ValueError) as error:
            came, do = str(error), "Simulate it with the engine `mujoco`."
            raise BadInput("model", "features that MuJoCo Warp supports", came, do) from None

    def _bind(self) -> None:
        """Torch's views of Warp's arrays."""
        to_torch, data = self._wp.to_torch, self._data
        self._time, self._qpos, self._qvel = to_torch(data.time), to_torch(data.qpos), to_torch(data.qvel)
        self._ctrl, self._act, self._history = to_torch(data.ctrl), to_torch(data.act), to_torch(data.history)
        self._warmstart = to_torch(data.qacc_warmstart)
        self._xpos, self._xquat = to_torch(data.xpos), to_torch(data.xquat)
        self._actuator_force, self._sensordata = to_torch(data.actuator_force), to_torch(data.sensordata)
        if self._offset is not None:
            self._believed_qpos, self._believed_xpos = to_torch(self._believed.qpos), to_torch(self._believed.xpos)

    def _index(self, values: list[int]) -> Tensor:
        return torch.tensor(values, dtype=torch.long, device=self.device)

    def _stand(self) -> None:
        """Every world at the model's first keyframe, or its default state."""
        model, n = self.model, self.num_worlds
        pose = model.key_qpos[0] if model.nkey else model.qpos0
        held = model.key_ctrl[0] if model.nkey else np.zeros(model.nu)
        qpos, qvel, targets = (
            torch.as_tensor(np.tile(row, (n, 1)), dtype=torch.float32, device=self.device)
            for row in (pose, np.zeros(model.nv), held)
        )
        self.reset(torch.ones(n, dtype=torch.bool, device=self.device), qpos, qvel, targets)
        self.settle()

    def _advance(self) -> None:
        """A control period."""
        for _ in range(self.substeps - 1):
            self._inner()
        self._last_step()

    def _inner(self) -> None:
        """A physics step but the last of a control period, at whose end alone sensors are asked."""
        option, flags = self._model.opt, self._model.opt.disableflags
        option.disableflags = flags | int(mujoco.mjtDisableBit.mjDSBL_SENSOR)
        self._mjw.step(self._model, self._data)
        option.disableflags = flags

    def _last_step(self) -> None:
        self._mjw.step(self._model, self._data)
        self._kinematics()

    def _kinematics(self) -> None:
        """Make the bodies' places current; a step leaves those of its start."""
        self._mjw.kinematics(self._model, self._data)

    def _read_encoders(self) -> None:
        """Put the bodies of `_believed` where the encoders say that they are."""
        if self._offset is None:
            return
        self._believed_qpos.copy_(self._qpos)
        self._believed_qpos[:, 7:] += self._offset
        self._run("read", lambda: self._mjw.kinematics(self._model, self._believed))

    def _run(self, name: str, work: Callable[[], None]) -> None:
        """Do Warp's work in the order of torch's stream; after the first time as a recorded graph."""
        if self.device.type == "cpu":
            with self._wp.ScopedDevice("cpu"):
                work()
        else:
            self._launch(name, work)

    def _launch(self, name: str, work: Callable[[], None]) -> None:
        wp = self._wp
        stream = wp.stream_from_torch(torch.cuda.current_stream(self.device))
        if name not in self._graphs and name in self._seen:
            torch.cuda.synchronize(self.device)
            with wp.ScopedDevice(str(self.device)), wp.ScopedCapture() as capture:
                work()
            self._graphs[name] = capture.graph
        if name in self._graphs:
            wp.capture_launch(self._graphs[name], stream=stream)
            return
        self._seen.add(name)  # the first call loads the kernels, which a recording cannot
        with wp.ScopedStream(stream):
            work()
