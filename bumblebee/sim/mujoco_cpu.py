"""The CPU engine: MuJoCo's `batch.Batch`, many worlds on a few threads, seen through `sim.engine.Engine`."""

from collections.abc import Mapping
from typing import Protocol

import mujoco
import numpy as np
import torch
from mujoco.batch import Batch
from torch import Tensor

from bumblebee.errors import BadInput
from bumblebee.robot.facts import FEET, KEY_BODIES
from bumblebee.sim.engine import RobotState
from bumblebee.sim.places import Places
from bumblebee.sim.rotations import rotate_inverse
from bumblebee.sim.sensors import sensor_name
from bumblebee.sim.world_fields import MASSES

_NOTHING = int(mujoco.mjtStage.mjSTAGE_NONE)
# MuJoCo resets a world by itself when its state blows up, and counts it in these warnings.
_BAD = [int(w) for w in (mujoco.mjtWarning.mjWARN_BADQPOS, mujoco.mjtWarning.mjWARN_BADQVEL)]
_BAD.append(int(mujoco.mjtWarning.mjWARN_BADQACC))


class Hooks(Protocol):
    """Effects that are no part of the model: so far, what the encoders add to the joint angles, (J,) [rad]."""

    @property
    def encoder_offset(self) -> np.ndarray:
        """(J,) [rad]."""


class MujocoCpu:
    """An `Engine` of `num_worlds` copies of `model` on `threads` threads.

    Args:
        model: free base first, then hinges with one position servo each, and the foot sensors of `sim.sensors`.
        num_worlds: how many robots.
        control_hz: rate of the policy; a whole number of physics steps must fit.
        threads: CPU threads, the caller's included.
        hooks: effects outside the model, see `bumblebee.sim.effects.runtime_hooks`.
    """

    by_mask = False

    def __init__(
        self,
        model: mujoco.MjModel,
        num_worlds: int,
        control_hz: float = 50.0,
        threads: int = 2,
        hooks: Hooks | None = None,
    ) -> None:
        self.model, self.num_worlds, self.control_dt = model, num_worlds, 1.0 / control_hz
        self.device = torch.device("cpu")
        self.substeps = substeps_of(model, control_hz)
        self.batch = Batch(model, num_worlds, threads)
        self._places = Places(model, num_worlds, threads)
        self._offset: np.ndarray | None = None
        if hooks is not None and np.any(hooks.encoder_offset):
            self._offset = np.asarray(hooks.encoder_offset, dtype=np.float64)
            self._believed = Places(model, num_worlds, threads)
        self._keys = [model.body(name).id for name in KEY_BODIES]
        self._feet = [model.body(name).id for name in FEET]
        self._force = foot_sensor_columns(model)
        self._time, self._qpos, self._qvel = (self.batch.bind(name) for name in ("time", "qpos", "qvel"))
        self._ctrl, self._act, self._warmstart = (self.batch.bind(name) for name in ("ctrl", "act", "qacc_warmstart"))
        self._actuator_force, self._sensordata = self.batch.bind("actuator_force"), self.batch.bind("sensordata")
        self._history, self._held = history_template(model)
        self._warnings = np.zeros(num_worlds, dtype=np.int64)
        self._unstable = torch.zeros(num_worlds, dtype=torch.bool)
        self.batch.reset(keyframe=0 if model.nkey else -1, stage=_NOTHING)
        self._places.find(self._qpos)

    def set_fields(self, fields: Mapping[str, np.ndarray]) -> None:
        """See `Engine.set_fields`."""
        for name, values in fields.items():
            self.batch.expand(name)[:] = values
        if MASSES & set(fields):
            self.batch.set_const()
        self._places.set_fields(fields)

    def reset(self, rows: Tensor, qpos: Tensor, qvel: Tensor, targets: Tensor) -> None:
        """See `Engine.reset`; makes the bodies' places current at once, of the chosen worlds only."""
        if rows.dtype == torch.bool:
            ids = rows.nonzero()[:, 0]
            qpos, qvel, targets = qpos[ids], qvel[ids], targets[ids]
        else:
            ids = rows
        if len(ids) == 0:
            return
        i, held = ids.numpy(), targets.numpy()
        self._time[i] = 0.0
        self._qpos[i] = qpos.numpy()
        self._qvel[i] = qvel.numpy()
        self._ctrl[i] = held
        self._warmstart[i] = 0.0
        if self.model.na:
            self._act[i] = 0.0
        if len(self._history):
            filled = np.repeat(self._history[None], len(i), axis=0)
            for column, actuator in self._held:
                filled[:, column] = held[:, actuator]
            self.batch.history[i] = filled
        self._places.find(self._qpos[i], i)
        self._unstable[ids] = False

    def settle(self) -> None:
        """See `Engine.settle`: nothing is left to do."""

    def check(self) -> None:
        """See `Engine.check`: MuJoCo's buffers grow."""

    def step(self, targets: Tensor) -> None:
        """See `Engine.step`."""
        self._ctrl[:] = targets.numpy()
        self.batch.step(nstep=self.substeps)
        self._places.find(self._qpos)
        counted = self.batch.warning[:, _BAD, 1].sum(axis=1)  # [last index, number]
        finite = np.isfinite(self._qpos.sum(axis=1) + self._qvel.sum(axis=1))
        self._unstable = torch.from_numpy((counted > self._warnings) | ~finite)
        self._warnings = counted

    def state(self) -> RobotState:
        """See `Engine.state`."""
        # Parts of their own: work on rows within longer ones is slower.
        qpos, qvel = self._qpos, self._qvel
        quat = _float(qpos[:, 3:7])
        read = None if self._offset is None else self._read_qpos()
        return RobotState(
            root_pos_w=_float(qpos[:, :3]),
            root_quat_w=quat,
            root_lin_vel_b=rotate_inverse(quat, _float(qvel[:, :3])),
            root_ang_vel_b=_float(qvel[:, 3:6]),
            joint_pos=_float((qpos if read is None else read)[:, 7:]),
            joint_vel=_float(qvel[:, 6:]),
            key_pos_w=_some(self._places.xpos, self._keys),
            read_key_pos_w=None if read is None else _some(self._believed.xpos, self._keys),
        )

    def _read_qpos(self) -> np.ndarray:
        """Positions as the encoders read them, (B, 7 + J); also puts the bodies of `_believed` there."""
        read = np.array(self.batch.qpos)
        read[:, 7:] += self._offset
        self._believed.find(read)
        return read

    def torque(self) -> Tensor:
        """See `Engine.torque`."""
        return _float(self._actuator_force)

    def foot_force_w(self) -> Tensor:
        """See `Engine.foot_force_w`."""
        # The sensor gives the force of the first body on the second: of the foot on the floor.
        return -_some(self._sensordata, self._force).unflatten(1, (2, 3))

    def foot_quat_w(self) -> Tensor:
        """See `Engine.foot_quat_w`."""
        return _some(self._places.xquat, self._feet)

    def push(self, velocity_w: Tensor) -> None:
        """See `Engine.push`."""
        self._qvel[:, :3] += velocity_w.numpy()

    def unstable(self) -> Tensor:
        """See `Engine.unstable`."""
        return self._unstable

    def state_dict(self) -> dict[str, np.ndarray]:
        """All that the next step depends on, to go on later from here."""
        return {"state": self.batch.state.copy()}

    def load_state_dict(self, saved: dict[str, np.ndarray]) -> None:
        """Go on from what `state_dict` gave."""
        self.batch.state[:] = saved["state"]
        self._places.find(self._qpos)


def substeps_of(model: mujoco.MjModel, control_hz: float) -> int:
    """Physics steps in a control period.

    Raises:
        BadInput: if that is no whole number.
    """
    steps = 1.0 / control_hz / model.opt.timestep
    if abs(steps - round(steps)) > 1e-6:
        came = f"{1 / model.opt.timestep:g} Hz"
        raise BadInput("physics rate", f"a multiple of the control rate {control_hz:g} Hz", came)
    return round(steps)


def _float(values: np.ndarray) -> Tensor:
    return torch.from_numpy(values.astype(np.float32))


def _some(values: np.ndarray, columns: list[int]) -> Tensor:
    """Some of the columns (B, n, ...) of values (B, N, ...)."""
    return _float(values.take(columns, axis=1))


def foot_sensor_columns(model: mujoco.MjModel) -> list[int]:
    """Columns of the sensor data that hold the feet's forces, x y z, left then right."""
    names = {model.sensor(i).name for i in range(model.nsensor)}
    if missing := [sensor_name(foot) for foot in FEET if sensor_name(foot) not in names]:
        raise BadInput("model", "contact sensors under the feet", f"no {missing[0]}", "Load it with sim.load_model.")
    first = [int(model.sensor(sensor_name(foot)).adr[0]) for foot in FEET]
    return [a + k for a in first for k in range(3)]


def history_template(model: mujoco.MjModel) -> tuple[np.ndarray, list[tuple[slice, list[int]]]]:
    """The delay buffers of a fresh world, and for each delayed actuator the columns that hold its past commands."""
    template = mujoco.MjData(model).history.copy()
    held = []
    for actuator in range(model.nu):
        samples = int(model.actuator_history[actuator, 0])
        if samples:
            first = int(model.actuator_historyadr[actuator]) + 2 + samples  # user value, cursor, times; then values
            held.append((slice(first, first + samples), [actuator]))
    return template, held
