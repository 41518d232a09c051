"""Reads pickles of plain values and numeric arrays, joblib's too, without executing what they carry.

A pickle is a program: it may name any function of any module and call it. Here no name is ever imported: the few that
an array's pickle uses stand for inert classes of this module, every other one is refused, and calls, states and sizes
are checked. joblib writes the bytes of each array behind its description, after padding (`joblib.numpy_pickle`).
"""

import bz2
import io
import lzma
import math
import pickle
import re
import struct
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from bumblebee.errors import BadInput

MAX_BYTES = 1 << 30  # of a file, and of what it unpacks to
_MAX_DIMENSIONS = 8
_NUMERIC = re.compile(r"[<>=|]?[biuf][1248]|bool")


_BROKEN = (ValueError, TypeError, LookupError, AttributeError, OverflowError, MemoryError, RecursionError)


class RefusedError(Exception):
    """The pickle holds something that is neither a plain value nor a numeric array."""


def load(path: Path) -> Any:
    """The pickle's content: dicts, lists, tuples, strings, numbers, and numpy arrays.

    Raises:
        BadInput: empty, truncated or hostile file, or arrays of objects.
    """
    try:
        data = _unpacked(path)
        return _plain(_SafeUnpickler(data).load(), {})
    except RefusedError as refusal:
        raise BadInput(
            path, "a pickle of plain values and numeric arrays", str(refusal), "Nothing of it was executed."
        ) from None
    except (EOFError, struct.error, zlib.error, lzma.LZMAError, OSError) as error:
        raise BadInput(path, "a whole pickle", f"one that ends early ({error})", "Copy the file again.") from None
    except pickle.UnpicklingError as error:
        ended = "truncated" in str(error) or "exhausted" in str(error)
        came = f"one that ends early ({error})" if ended else f"a broken one ({error})"
        raise BadInput(path, "a whole pickle", came, "Copy the file again.") from None
    except _BROKEN as error:
        came = f"a broken one ({type(error).__name__}: {error})"
        raise BadInput(path, "a whole pickle", came, "Copy the file again.") from None


def _unpacked(path: Path) -> bytes:
    """The file's bytes, decompressed as joblib compresses, within `MAX_BYTES`."""
    if path.stat().st_size > MAX_BYTES:
        raise RefusedError(f"a file of more than {MAX_BYTES >> 20} MiB")
    raw = path.read_bytes()
    if not raw:
        raise BadInput(path, "a pickle", "an empty file", "Copy the file again.")
    for magic, maker in _DECOMPRESSORS.items():
        if raw.startswith(magic):
            return _decompress(raw, maker())
    if raw.startswith((b"\x04\x22\x4d\x18", b"ZF")):
        raise RefusedError("a compression (lz4 or joblib before 0.10) that is not read: save it with compress=0")
    return raw


def _decompress(raw: bytes, decompressor: Any) -> bytes:
    data = decompressor.decompress(raw, MAX_BYTES)
    if not decompressor.eof:
        if len(data) >= MAX_BYTES:
            raise RefusedError(f"a pickle that unpacks to more than {MAX_BYTES >> 20} MiB")
        raise EOFError("the compressed stream is truncated")
    return data


_DECOMPRESSORS: dict[bytes, Callable[[], Any]] = {
    b"\x78": zlib.decompressobj,
    b"\x1f\x8b": lambda: zlib.decompressobj(wbits=31),
    b"BZ": bz2.BZ2Decompressor,
    b"\xfd7zXZ": lzma.LZMADecompressor,
    b"\x5d\x00": lzma.LZMADecompressor,
}


class _NDArray:
    """Stands for `numpy.ndarray` where a pickle names it; never made."""


class _DType:
    """Stands for `numpy.dtype`: a description as text."""

    def __init__(self, text: Any, *_: object) -> None:
        self.text = text

    def set_state(self, state: Any) -> None:
        if isinstance(state, tuple) and len(state) > 1 and state[1] in ("<", ">", "|", "="):
            self.text = f"{state[1]}{str(self.text).lstrip('<>=|')}"

    def numpy(self) -> np.dtype:
        if not isinstance(self.text, str) or not _NUMERIC.fullmatch(self.text):
            raise RefusedError(f"an array of dtype {self.text!r}, which is not numeric")
        return np.dtype(self.text)


class _Array:
    """Stands for an array that numpy pickled itself."""

    def __init__(self) -> None:
        self.value: np.ndarray | None = None

    def set_state(self, state: Any) -> None:
        _, shape, dtype, fortran, raw = state
        self.value = _array(raw, dtype, shape, "F" if fortran else "C")


class _JoblibWrapper:
    """Stands for `joblib.numpy_pickle.NumpyArrayWrapper`: describes an array whose bytes follow in the file."""

    def __init__(self) -> None:
        self.facts: dict[str, Any] = {}

    def set_state(self, state: Any) -> None:
        if not isinstance(state, dict):
            raise RefusedError("an array wrapper without its facts")
        self.facts = state

    def read(self, file: io.BytesIO) -> np.ndarray:
        dtype, count = _dtype(self.facts["dtype"]), _count(self.facts["shape"])
        if self.facts.get("numpy_array_alignment_bytes") is not None:
            padding = file.read(1)
            if not padding:
                raise EOFError("in the padding of an array")
            file.read(padding[0])
        raw = file.read(_checked_size(count, dtype))
        return _array(raw, self.facts["dtype"], self.facts["shape"], self.facts["order"])


def _dtype(description: Any) -> np.dtype:
    return (description if isinstance(description, _DType) else _DType(description)).numpy()


def _count(shape: Any) -> int:
    whole = isinstance(shape, tuple) and all(type(n) is int and n >= 0 for n in shape)
    if not whole or len(shape) > _MAX_DIMENSIONS:
        raise RefusedError(f"an array of shape {str(shape)[:60]}")
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


def _reconstruct(*_: object) -> _Array:
    return _Array()


def _scalar(dtype: Any, raw: Any) -> float | int | bool:
    return _array(raw, dtype, (), "C").item()


def _encode(text: Any, encoding: Any = "latin1") -> bytes:
    if not isinstance(text, str) or encoding != "latin1":
        raise RefusedError(f"text in encoding {encoding!r}")
    return text.encode("latin1")


def _no_bytes() -> bytes:
    return b""  # so protocols 0 to 2 write the bytes of an empty array


_NAMES: dict[tuple[str, str], Any] = {
    ("numpy", "ndarray"): _NDArray,
    ("numpy", "dtype"): _DType,
    ("joblib.numpy_pickle", "NumpyArrayWrapper"): _JoblibWrapper,
    ("_codecs", "encode"): _encode,
    ("__builtin__", "bytes"): _no_bytes,
    **{(f"numpy.{core}.multiarray", "_reconstruct"): _reconstruct for core in ("core", "_core")},
    **{(f"numpy.{core}.multiarray", "scalar"): _scalar for core in ("core", "_core")},
    **{(f"numpy.{core}.numeric", "_frombuffer"): _array for core in ("core", "_core")},
}
_CALLABLE = (_DType, _reconstruct, _scalar, _array, _encode, _no_bytes)


class _SafeUnpickler(pickle._Unpickler):  # the one in Python: it reads no further than joblib's arrays begin
    dispatch: ClassVar[dict[int, Any]] = dict(pickle._Unpickler.dispatch)
    stack: list[Any]
    append: Callable[[Any], None]
    read: Callable[[int], bytes]

    def __init__(self, data: bytes) -> None:
        self._stream = io.BytesIO(data)
        self._size = len(data)
        super().__init__(self._stream)

    def find_class(self, module: str, name: str) -> Any:
        if (module, name) not in _NAMES:
            raise RefusedError(f"the name {module}.{name}"[:120])
        return _NAMES[module, name]

    def persistent_load(self, pid: Any) -> Any:
        raise RefusedError("a persistent id")

    def get_extension(self, code: int) -> None:
        raise RefusedError("an extension code")

    def load_reduce(self) -> None:
        args, function = self.stack.pop(), self.stack[-1]
        if not any(function is known for known in _CALLABLE) or not isinstance(args, tuple):
            raise RefusedError(f"a call of {_called(function)}")
        self.stack[-1] = function(*args)

    def load_newobj(self) -> None:
        args, kind = self.stack.pop(), self.stack.pop()
        if kind is not _JoblibWrapper or args != ():
            raise RefusedError(f"an object of {_called(kind)}")
        self.append(_JoblibWrapper())

    def load_refused(self) -> None:
        raise RefusedError("an instruction that makes objects in a way arrays do not need")

    def load_build(self) -> None:
        state, made = self.stack.pop(), self.stack[-1]
        if not isinstance(made, _DType | _Array | _JoblibWrapper):
            raise RefusedError(f"a state for a {type(made).__name__}")
        made.set_state(state)
        if isinstance(made, _JoblibWrapper):
            self.stack[-1] = made.read(self._stream)

    def load_bytearray8(self) -> None:
        (length,) = struct.unpack("<Q", self.read(8))
        if length > self._size:
            raise EOFError("a byte array longer than the file")
        self.append(bytearray(self.read(length)))

    dispatch[pickle.REDUCE[0]] = load_reduce
    dispatch[pickle.NEWOBJ[0]] = load_newobj
    dispatch[pickle.BUILD[0]] = load_build
    dispatch[pickle.BYTEARRAY8[0]] = load_bytearray8
    for _opcode in (pickle.NEWOBJ_EX, pickle.INST, pickle.OBJ, pickle.EXT1, pickle.EXT2, pickle.EXT4):
        dispatch[_opcode[0]] = load_refused


def _called(function: Any) -> str:
    return str(getattr(function, "__name__", type(function).__name__)).lstrip("_")


def _plain(value: Any, done: dict[int, Any]) -> Any:
    """Arrays in place of their stand-ins, in a dict or a dict of dicts; what the file repeats is converted once."""
    if id(value) not in done:
        if isinstance(value, _Array):
            if value.value is None:
                raise RefusedError("an array without its values")
            done[id(value)] = value.value
        elif isinstance(value, dict):
            done[id(value)] = value  # a dict that holds itself ends here
            done[id(value)] = {key: _plain(item, done) for key, item in value.items() if isinstance(key, str | int)}
        else:
            return value
    return done[id(value)]
