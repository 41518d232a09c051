"""Torch tensors that NumPy's functions accept, so that a law written for arrays also runs on a GPU.

`sim.effects.forces` is written in NumPy. Given `DeviceArray`s instead of arrays it does the same with torch, through
NumPy's own protocols (NEP 13 and 18): every function in the two tables below, operators, indexing and assignment.
Arrays of constants that meet a DeviceArray are copied to its device once and kept by their content, so that the work
may be recorded as a CUDA graph after it was done once. What is not in the tables is a TypeError.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
import torch
from numpy.lib.mixins import NDArrayOperatorsMixin
from torch import Tensor

_RENAMED = {"absolute": "abs", "power": "pow", "rint": "round", "true_divide": "div", "conjugate": "conj"}
_NEED_TENSORS = ("maximum", "minimum")


class DeviceArray(NDArrayOperatorsMixin):
    """A tensor behind an array's interface; `tensor` is what it holds."""

    def __init__(self, tensor: Tensor) -> None:
        self.tensor = tensor

    @property
    def shape(self) -> tuple[int, ...]:
        """As an array's."""
        return tuple(self.tensor.shape)

    @property
    def ndim(self) -> int:
        """As an array's."""
        return self.tensor.ndim

    @property
    def T(self) -> "DeviceArray":  # noqa: N802
        """As a matrix's."""
        return DeviceArray(self.tensor.T)

    def __len__(self) -> int:
        """As an array's."""
        return len(self.tensor)

    def copy(self) -> "DeviceArray":
        """A copy."""
        return DeviceArray(self.tensor.clone())

    def sum(self, axis: int | None = None) -> "DeviceArray":
        """As an array's."""
        return DeviceArray(self.tensor.sum() if axis is None else self.tensor.sum(axis))

    def __getitem__(self, key: Any) -> Any:
        """Elements, as a view where an array would give one; the chosen ones of a mask stay where they are."""
        if isinstance(key, DeviceArray) and key.tensor.dtype == torch.bool:
            return _Chosen(self.tensor)
        return DeviceArray(self.tensor[_index(key, self.tensor.device)])

    def __setitem__(self, key: Any, value: Any) -> None:
        """Write in place; under a mask of worlds without a look at it."""
        tensor = self.tensor
        if isinstance(key, DeviceArray) and key.tensor.dtype == torch.bool:
            mask = key.tensor.reshape(key.tensor.shape + (1,) * (tensor.ndim - key.tensor.ndim))
            tensor.copy_(torch.where(mask, _operand(value, tensor, True), tensor))
            return
        # A scalar is filled in; anything else is spread out first.
        new = _operand(value, tensor, False)
        if isinstance(new, Tensor):
            tensor[_index(key, tensor.device)] = new.to(tensor.dtype)
        else:
            tensor[_index(key, tensor.device)] = new

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **more: Any) -> Any:
        """NumPy's universal functions, by torch's function of the same name."""
        out = more.pop("out", None)
        if method != "__call__" or more:
            return NotImplemented
        name = _RENAMED.get(ufunc.__name__, ufunc.__name__)
        work = getattr(torch, name, None)
        if work is None:
            return NotImplemented
        like = next(one.tensor for one in inputs if isinstance(one, DeviceArray))
        result = work(*(_operand(one, like, name in _NEED_TENSORS) for one in inputs))
        if out is not None:
            out[0].tensor.copy_(result)
            return out[0]
        return DeviceArray(result)

    def __array_function__(self, function: Callable, types: Any, arguments: Any, named: dict[str, Any]) -> Any:
        """NumPy's other functions, those of `_FUNCTIONS`."""
        if function not in _FUNCTIONS:
            return NotImplemented
        return _FUNCTIONS[function](*arguments, **named)


class _Chosen(DeviceArray):
    """All elements of a tensor, of which a mask has chosen some: to be written under the same mask."""


_constants: dict[tuple[Any, ...], Tensor] = {}


def constant(values: Any, device: torch.device) -> Tensor:
    """A small array of constants on `device`, copied there once: numbers as float32, whole numbers as int64."""
    array = np.asarray(values)
    key = (array.tobytes(), array.dtype.str, array.shape, str(device))
    if key not in _constants:
        kind = {"f": torch.float32, "b": torch.bool}.get(array.dtype.kind, torch.int64)
        _constants[key] = torch.as_tensor(np.array(array)).to(device, kind)
    return _constants[key]


def _operand(value: Any, like: Tensor, as_tensor: bool) -> Any:
    """Operand for torch in place of `value`: a tensor on the device of `like`, or, unless `as_tensor`, a number."""
    if isinstance(value, DeviceArray):
        return value.tensor
    if isinstance(value, np.ndarray) and value.ndim:
        return constant(value, like.device)
    number = value.item() if isinstance(value, np.generic | np.ndarray) else value
    return constant(number, like.device).to(like.dtype) if as_tensor else number


def _index(key: Any, device: torch.device) -> Any:
    """An index that torch takes; a constant mask becomes the places that it chooses."""
    if isinstance(key, tuple):
        return tuple(_index(one, device) for one in key)
    if isinstance(key, np.ndarray):
        return constant(np.flatnonzero(key) if key.dtype == bool else key, device)
    return key.tensor if isinstance(key, DeviceArray) else key


def _first(values: Any) -> Tensor:
    return next(one.tensor for one in values if isinstance(one, DeviceArray))


def _where(condition: Any, a: Any, b: Any) -> DeviceArray:
    like = _first((a, b, condition))
    chosen = like if like.dtype != torch.bool else torch.zeros((), device=like.device)
    test = _operand(condition, like, True)
    return DeviceArray(torch.where(test.bool(), _operand(a, chosen, True), _operand(b, chosen, True)))


def _clip(values: Any, low: Any, high: Any) -> DeviceArray:
    like = _first((values, low, high))
    value = _operand(values, like, True)
    return DeviceArray(torch.minimum(torch.maximum(value, _operand(low, like, True)), _operand(high, like, True)))


def _interp(x: Any, xp: Any, fp: Any) -> DeviceArray:
    """Straight lines between the points, constant beyond them."""
    at = x.tensor
    points, values = (constant(np.asarray(one, float), at.device).to(at.dtype) for one in (xp, fp))
    place = torch.searchsorted(points, at.contiguous(), right=True).clamp(1, len(points) - 1)
    low, high = points[place - 1], points[place]
    share = ((at - low) / (high - low)).clamp(0.0, 1.0)
    return DeviceArray(torch.lerp(values[place - 1], values[place], share))


def _concatenate(parts: Any, axis: int = 0) -> DeviceArray:
    like = _first(parts)
    return DeviceArray(torch.cat([_operand(one, like, True) for one in parts], dim=axis))


_FUNCTIONS: dict[Callable, Callable] = {
    np.where: _where,
    np.clip: _clip,
    np.interp: _interp,
    np.concatenate: _concatenate,
    np.round: lambda x: DeviceArray(torch.round(x.tensor)),
    np.copy: lambda x: x.copy(),
    np.zeros_like: lambda x: DeviceArray(torch.zeros_like(x.tensor)),
    np.ones_like: lambda x: DeviceArray(torch.ones_like(x.tensor)),
}
