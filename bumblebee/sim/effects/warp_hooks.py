"""The hooks of `sim.effects.forces` beside MuJoCo Warp: the same equations, on torch tensors that are Warp's arrays.

`WarpBatch` shows a Warp model and its data as `StepHooks` expects a `mujoco.batch.Batch`, with `DeviceArray`s for
arrays. Nothing of `apply`, `read` and `restart` looks at values on the host: all may be recorded as CUDA graphs.
"""

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import mujoco
import torch
from torch import Tensor

from bumblebee.effects.terms import Term, _value
from bumblebee.sim.device_arrays import DeviceArray
from bumblebee.sim.effects.forces import StepHooks
from bumblebee.sim.effects.hooks import RuntimeHooks
from bumblebee.sim.effects.memory import REMEMBERED

_KINDS = {"fresh": torch.bool, "time": torch.float64}  # clocks that strike on time are sums of thousands of steps


class WarpBatch:
    """Warp's model and data of `nsim` worlds under the names and in the shapes of `MjModel` and `MjData`."""

    def __init__(self, wp: Any, model: Any, data: Any, device: torch.device) -> None:
        self._wp, self._model, self._data, self.device = wp, model, data, device
        self.nsim = int(data.nworld)
        self._bound: dict[str, DeviceArray] = {}

    def bind(self, name: str) -> DeviceArray:
        """A field of the data, (B, ...); Warp's own memory."""
        if name not in self._bound:
            self._bound[name] = DeviceArray(self._wp.to_torch(getattr(self._data, name)))
        return self._bound[name]

    def expand(self, name: str) -> DeviceArray:
        """A field of the model with a row for each world, (B, ...); Warp's own memory from now on."""
        array = getattr(self._model, name)
        if array.shape[0] != self.nsim:
            rows = self._wp.to_torch(array).expand(self.nsim, *[-1] * (self._wp.to_torch(array).ndim - 1)).contiguous()
            array = self._wp.from_torch(rows.clone(), dtype=array.dtype)
            setattr(self._model, name, array)
        return DeviceArray(self._wp.to_torch(array))


class _DeviceTerm:
    """A discovered term whose value stays on the device."""

    def __init__(self, term: Term) -> None:
        self._term = term

    def __getattr__(self, name: str) -> Any:
        return getattr(self._term, name)

    def __call__(self, values: dict[str, DeviceArray]) -> Any:
        return _value(self._term._tree, values)  # type: ignore[arg-type]


class WarpHooks(StepHooks):
    """`StepHooks` of a `WarpBatch`; all that it remembers stays in the same tensors, for graphs."""

    def __init__(self, hooks: RuntimeHooks, model: mujoco.MjModel, batch: WarpBatch) -> None:
        terms = tuple((column, coefficient, _DeviceTerm(term)) for column, coefficient, term in hooks.terms)
        super().__init__(replace(hooks, terms=terms), model, batch)  # type: ignore[arg-type]
        self.own: dict[str, Tensor] = {}
        for name in REMEMBERED:
            start = torch.as_tensor(getattr(self, f"_{name}"))
            kind = _KINDS.get(name, torch.float32)
            self.own[name] = start.to(batch.device, kind)
            setattr(self, f"_{name}", DeviceArray(self.own[name]))

    def apply(self) -> None:
        """Write everything that the next physics step needs."""
        super().apply()
        self._put_back()

    def readings(self) -> Tensor:
        """Positions (B, J) [rad] as the encoders read them now."""
        return _tensor(self.read())

    def torques(self) -> Tensor:
        """Torques (B, J) [N m] beside Warp's own servos in the last step."""
        return _tensor(self.applied)

    def restart(self, rows: Tensor) -> None:
        """The worlds `rows` (B,) bool begin anew, at rest."""
        before = {name: tensor.clone() for name, tensor in self.own.items()}
        super().reset(slice(None))  # type: ignore[arg-type]
        self._put_back()
        for name, tensor in self.own.items():
            chosen = rows.reshape(-1, *(1,) * (tensor.ndim - 1))
            tensor.copy_(torch.where(chosen, tensor, before[name]))

    def refresh(self, fields: Iterable[str]) -> None:
        """Some fields of the model have new arrays: write into those, on top of their values."""
        for name in set(fields) & set(self._written):
            self._written[name] = self._batch.expand(name)
        self.rebase(fields)

    def _put_back(self) -> None:
        """Where the equations made a new array of something remembered, copy it into the one that stays."""
        for name, tensor in self.own.items():
            now = getattr(self, f"_{name}")
            if now.tensor is not tensor:
                tensor.copy_(now.tensor)
                setattr(self, f"_{name}", DeviceArray(tensor))


def _tensor(values: Any) -> Tensor:
    return values.tensor
