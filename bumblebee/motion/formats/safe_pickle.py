"""Reads pickles of plain values and numeric arrays, joblib's too, without executing what they carry.

A pickle is a program: it may name any function of any module and call it. Here no name is ever imported: the few that
an array's pickle uses stand for inert classes of this module, every other one is refused, and calls, states and sizes
are checked. joblib writes the bytes of each array behind its description, after padding (`joblib.numpy_pickle`).
"""

import bz2
import io
import lzma
import pickle
import struct
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.io.read import read_bytes
from bumblebee.motion.formats.pickle_values import CALLABLE, KNOWN, MAX_BYTES, Array, DType, JoblibWrapper, RefusedError

MAX_STEPS = 2_000_000  # instructions of the pickle's program: a motion has a few dozen
_MAX_DICTIONARY = 256 << 20  # bytes that an xz or lzma stream may ask for itself; xz -9 asks for 65 MiB
_KEYS = str | int | float | bytes | None  # what a dict's keys may be: hashing a tuple of tuples can take for ever


_BROKEN = (ValueError, TypeError, LookupError, AttributeError, OverflowError, MemoryError, RecursionError)


def load(path: Path, data: bytes | None = None) -> Any:
    """The pickle's content: dicts, lists, tuples, strings, numbers, and numpy arrays.

    Args:
        path: the file.
        data: its bytes, where they have been read.

    Raises:
        BadInput: empty, truncated or hostile file, or arrays of objects.
    """
    try:
        raw = read_bytes(path, MAX_BYTES) if data is None else data
        return _plain(_SafeUnpickler(_unpacked(path, raw)).load(), {})
    except RefusedError as refusal:
        raise BadInput(
            path, "a pickle of plain values and numeric arrays", str(refusal), "Nothing of it was executed."
        ) from None
    except (EOFError, struct.error, zlib.error, lzma.LZMAError, OSError) as error:
        raise BadInput(path, "a whole pickle", f"one that ends early ({error})"[:200], "Copy the file again.") from None
    except pickle.UnpicklingError as error:
        ended = "truncated" in str(error) or "exhausted" in str(error)
        came = f"one that ends early ({error})" if ended else f"a broken one ({error})"
        raise BadInput(path, "a whole pickle", came[:200], "Copy the file again.") from None
    except _BROKEN as error:
        came = f"a broken one ({type(error).__name__}: {error})"
        raise BadInput(path, "a whole pickle", came[:200], "Copy the file again.") from None


def _unpacked(path: Path, raw: bytes) -> bytes:
    """The file's bytes, decompressed as joblib compresses, within `MAX_BYTES`."""
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
    b"\xfd7zXZ": lambda: lzma.LZMADecompressor(memlimit=_MAX_DICTIONARY),
    b"\x5d\x00": lambda: lzma.LZMADecompressor(memlimit=_MAX_DICTIONARY),
}


class _SafeUnpickler(pickle._Unpickler):  # the one in Python: it reads no further than joblib's arrays begin
    dispatch: ClassVar[dict[int, Any]] = dict(pickle._Unpickler.dispatch)
    stack: list[Any]
    append: Callable[[Any], None]
    read: Callable[[int], bytes]

    def __init__(self, data: bytes) -> None:
        self._stream = io.BytesIO(data)
        self._size = len(data)
        self._steps = self._made = 0
        super().__init__(self._stream)

    def count_step(self) -> None:
        self._steps += 1
        if self._steps > MAX_STEPS:
            raise RefusedError(f"a program of more than {MAX_STEPS:,} instructions")

    def spend(self, made: Any) -> Any:
        """Count the bytes of an array: a pickle can make one of the same bytes again and again."""
        value = made.value if isinstance(made, Array) else made
        self._made += value.nbytes if isinstance(value, np.ndarray) else len(value) if isinstance(value, bytes) else 0
        if self._made > MAX_BYTES:
            raise RefusedError(f"arrays of more than {MAX_BYTES >> 20} MiB")
        return made

    def find_class(self, module: str, name: str) -> Any:
        if (module, name) not in KNOWN:
            raise RefusedError(f"the name {module}.{name}"[:120])
        return KNOWN[module, name]

    def persistent_load(self, pid: Any) -> Any:
        raise RefusedError("a persistent id")

    def get_extension(self, code: int) -> None:
        raise RefusedError("an extension code")

    def load_reduce(self) -> None:
        args, function = self.stack.pop(), self.stack[-1]
        if not any(function is known for known in CALLABLE) or not isinstance(args, tuple):
            raise RefusedError(f"a call of {_called(function)}")
        self.stack[-1] = self.spend(function(*args))

    def load_newobj(self) -> None:
        args, kind = self.stack.pop(), self.stack.pop()
        if kind is not JoblibWrapper or args != ():
            raise RefusedError(f"an object of {_called(kind)}")
        self.append(JoblibWrapper())

    def load_refused(self) -> None:
        raise RefusedError("an instruction that makes objects in a way arrays do not need")

    def load_build(self) -> None:
        state, made = self.stack.pop(), self.stack[-1]
        if not isinstance(made, DType | Array | JoblibWrapper):
            raise RefusedError(f"a state for a {type(made).__name__}")
        made.set_state(state)
        if isinstance(made, JoblibWrapper):
            self.stack[-1] = made.read(self._stream)
        self.spend(self.stack[-1])

    def load_bytearray8(self) -> None:
        (length,) = struct.unpack("<Q", self.read(8))
        if length > self._size:
            raise EOFError("a byte array longer than the file")
        self.append(bytearray(self.read(length)))

    def load_setitem(self) -> None:
        self.check_keys(self.stack[-2:-1])
        super().load_setitem()  # type: ignore[misc]

    def load_setitems(self) -> None:
        self.check_keys(self.stack[::2])
        super().load_setitems()  # type: ignore[misc]

    def load_dict(self) -> None:
        self.check_keys(self.stack[::2])
        super().load_dict()  # type: ignore[misc]

    def check_keys(self, keys: list[Any]) -> None:
        for key in keys:
            if not isinstance(key, _KEYS):
                raise RefusedError(f"a {type(key).__name__} as a key")

    dispatch[pickle.REDUCE[0]] = load_reduce
    dispatch[pickle.NEWOBJ[0]] = load_newobj
    dispatch[pickle.BUILD[0]] = load_build
    dispatch[pickle.BYTEARRAY8[0]] = load_bytearray8
    dispatch[pickle.SETITEM[0]] = load_setitem
    dispatch[pickle.SETITEMS[0]] = load_setitems
    dispatch[pickle.DICT[0]] = load_dict
    for _opcode in (pickle.NEWOBJ_EX, pickle.INST, pickle.OBJ, pickle.EXT1, pickle.EXT2, pickle.EXT4):
        dispatch[_opcode[0]] = load_refused
    for _opcode in (pickle.EMPTY_SET, pickle.ADDITEMS, pickle.FROZENSET):  # a set hashes what it holds
        dispatch[_opcode[0]] = load_refused


def _counted(instruction: Callable[[Any], None]) -> Callable[[Any], None]:
    def run(unpickler: _SafeUnpickler) -> None:
        unpickler.count_step()
        instruction(unpickler)

    return run


def _short(instruction: Callable[[Any], None]) -> Callable[[Any], None]:
    """An instruction that reads a whole number; one may have a gigabyte, and no motion needs more than eight."""

    def run(unpickler: _SafeUnpickler) -> None:
        instruction(unpickler)
        if not -(2**63) <= unpickler.stack[-1] < 2**64:
            raise RefusedError("a whole number of more than 64 bits")

    return run


_dispatch = _SafeUnpickler.dispatch
_dispatch |= {code[0]: _short(_dispatch[code[0]]) for code in (pickle.INT, pickle.LONG, pickle.LONG1, pickle.LONG4)}
_dispatch |= {opcode: _counted(instruction) for opcode, instruction in _dispatch.items()}


def _called(function: Any) -> str:
    return str(getattr(function, "__name__", type(function).__name__)).lstrip("_")


def _plain(value: Any, done: dict[int, Any]) -> Any:
    """Arrays in place of their stand-ins, in a dict or a dict of dicts; what the file repeats is converted once."""
    if id(value) not in done:
        if isinstance(value, Array):
            if value.value is None:
                raise RefusedError("an array without its values")
            done[id(value)] = value.value
        elif isinstance(value, dict):
            done[id(value)] = value  # a dict that holds itself ends here
            done[id(value)] = {key: _plain(item, done) for key, item in value.items() if isinstance(key, str | int)}
        else:
            return value
    return done[id(value)]
