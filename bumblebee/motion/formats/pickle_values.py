"""The few things that an array's pickle names, as inert stand-ins: each makes an array, a number or bytes, checked."""

import io
import math
import re
from typing import Any

import numpy as np

MAX_BYTES = 1 << 30  # of a file, of what it unpacks to, and of all arrays that it makes
_MAX_DIMENSIONS = 8
_NUMERIC = re.compile(r"[<>=|]?[biuf][1248]|bool")


class RefusedError(Exception):
    """The pickle holds something that is neither a plain value nor a numeric array."""


class NDArray:
    """Stands for `numpy.ndarray` where a pickle names it; never made."""


class DType:
    """Stands for `numpy.dtype`: a description as text."""

    def __init__(self, text: Any, *_: object) -> None:
        self.text = text

    def set_state(self, state: Any) -> None:
        """Take the byte order."""
        if isinstance(state, tuple) and len(state) > 1 and state[1] in ("<", ">", "|", "="):
            self.text = f"{state[1]}{_brief(self.text).lstrip('<>=|')}"

    def numpy(self) -> np.dtype:
        """The type of numbers that is meant."""
        if not isinstance(self.text, str) or not _NUMERIC.fullmatch(self.text):
            raise RefusedError(f"an array of dtype {_brief(self.text)!r}, which is not numeric")
        return np.dtype(self.text)


class Array:
    """Stands for an array that numpy pickled itself."""

    def __init__(self) -> None:
        self.value: np.ndarray | None = None

    def set_state(self, state: Any) -> None:
        """Take shape, type and bytes."""
        _, shape, dtype, fortran, raw = state
        self.value = _array(raw, dtype, shape, "F" if fortran else "C")


class JoblibWrapper:
    """Stands for `joblib.numpy_pickle.NumpyArrayWrapper`: describes an array whose bytes follow in the file."""

    def __init__(self) -> None:
        self.facts: dict[str, Any] = {}

    def set_state(self, state: Any) -> None:
        """Take shape, type and order."""
        if not isinstance(state, dict):
            raise RefusedError("an array wrapper without its facts")
        self.facts = state

    def read(self, file: io.BytesIO) -> np.ndarray:
        """The array that follows in the file."""
        dtype, count = _dtype(self.facts["dtype"]), _count(self.facts["shape"])
        if self.facts.get("numpy_array_alignment_bytes") is not None:
            padding = file.read(1)
            if not padding:
                raise EOFError("in the padding of an array")
            file.read(padding[0])
        raw = file.read(_checked_size(count, dtype))
        return _array(raw, self.facts["dtype"], self.facts["shape"], self.facts["order"])


def _dtype(description: Any) -> np.dtype:
    return (description if isinstance(description, DType) else DType(description)).numpy()


def _count(shape: Any) -> int:
    whole = isinstance(shape, tuple) and all(type(n) is int and n >= 0 for n in shape)
    if not whole or len(shape) > _MAX_DIMENSIONS:
        raise RefusedError(f"an array of shape {_brief(shape)}")
    return math.prod(shape)


def _checked_size(count: int, dtype: np.dtype) -> int:
    if count * dtype.itemsize > MAX_BYTES:
        raise RefusedError(f"an array of more than {MAX_BYTES >> 20} MiB")
    return count * dtype.itemsize


def _array(raw: Any, dtype: Any, shape: Any, order: Any) -> np.ndarray:
    kind, count = _dtype(dtype), _count(shape)
    if not isinstance(raw, bytes | bytearray):
        raise RefusedError(f"an array made of {type(raw).__name__}, not of bytes")
    if len(raw) != _checked_size(count, kind):
        raise EOFError(f"an array has {len(raw)} of {count * kind.itemsize} bytes")
    values = np.frombuffer(bytes(raw), kind).reshape(shape, order="F" if order == "F" else "C")
    return values.astype(kind.newbyteorder("="))


def _brief(value: Any) -> str:
    """A value in a few words; a container's own text may be exponentially long."""
    if isinstance(value, tuple) and all(type(item) is int for item in value):
        return str(value[:_MAX_DIMENSIONS])
    return str(value)[:60] if isinstance(value, str | int | float | bytes | None) else f"a {type(value).__name__}"


def _reconstruct(*_: object) -> Array:
    return Array()


def _scalar(dtype: Any, raw: Any) -> float | int | bool:
    return _array(raw, dtype, (), "C").item()


def _encode(text: Any, encoding: Any = "latin1") -> bytes:
    if not isinstance(text, str) or encoding != "latin1":
        raise RefusedError(f"text in encoding {_brief(encoding)!r}")
    return text.encode("latin1")


def _no_bytes() -> bytes:
    return b""  # so protocols 0 to 2 write the bytes of an empty array


KNOWN: dict[tuple[str, str], Any] = {
    ("numpy", "ndarray"): NDArray,
    ("numpy", "dtype"): DType,
    ("joblib.numpy_pickle", "NumpyArrayWrapper"): JoblibWrapper,
    ("_codecs", "encode"): _encode,
    ("__builtin__", "bytes"): _no_bytes,
    **{(f"numpy.{core}.multiarray", "_reconstruct"): _reconstruct for core in ("core", "_core")},
    **{(f"numpy.{core}.multiarray", "scalar"): _scalar for core in ("core", "_core")},
    **{(f"numpy.{core}.numeric", "_frombuffer"): _array for core in ("core", "_core")},
}
CALLABLE = (DType, _reconstruct, _scalar, _array, _encode, _no_bytes)
