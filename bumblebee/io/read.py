"""The one way in: bytes, text, YAML, JSON and arrays from files that somebody else may have written.

Every function raises `BadInput` in one line (what, where, expected, came) and nothing else, and never executes, expands
or allocates more than `Limits` allow.
"""

import hashlib
import io
import json
import os
import stat
import zipfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import yaml

from bumblebee.errors import BadInput
from bumblebee.io.limits import LIMITS, Limits

_POINTER = b"version https://git-lfs.github.com/spec/v1\n"


def read_bytes(path: Path, most: int = LIMITS.file_bytes) -> bytes:
    """The bytes of a regular file of at most `most` bytes; pipes, devices and folders are refused, not waited for."""
    try:
        with open_file(path, most) as stream:
            size = os.fstat(stream.fileno()).st_size
            data = stream.read(size + 1)  # not `most + 1`, which Python allocates at once
            return data if len(data) <= size else data + stream.read(most - size)
    except OSError as error:
        raise BadInput(path, "a file that can be read", error.strerror or str(error)) from None


def open_file(path: Path, most: int = LIMITS.file_bytes) -> BinaryIO:
    """Open a file within the same limits, for what reads parts of it."""
    try:
        # Opening a pipe would wait for a writer; O_NONBLOCK does not.
        handle = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    except FileNotFoundError:
        raise BadInput(path, "a file", "no such file") from None
    except (OSError, ValueError) as error:
        raise BadInput(path, "a file that can be read", getattr(error, "strerror", None) or str(error)) from None
    facts = os.fstat(handle)
    if not stat.S_ISREG(facts.st_mode):  # asked first: no stream can be made of a folder
        os.close(handle)
        came = "a folder" if stat.S_ISDIR(facts.st_mode) else "a pipe, device or socket"
        raise BadInput(path, "a file", came)
    if facts.st_size > most:
        os.close(handle)
        raise BadInput(path, f"at most {most:,} bytes", f"{facts.st_size:,}")
    stream = os.fdopen(handle, "rb")
    try:
        refuse_pointer(path, stream.peek(len(_POINTER)))
    except BaseException:
        stream.close()
        raise
    return stream


def refuse_pointer(where: object, data: bytes) -> None:
    """Refuse the few lines that git keeps in place of a file in Git LFS, whatever the file's name.

    Args:
        where: the file's place in the message.
        data: its first bytes, or all of them.

    Raises:
        BadInput: a pointer.
    """
    if data.startswith(_POINTER):
        came = "a Git LFS pointer, which only says where the file's content is kept"
        raise BadInput(where, "the file's content", came, "Fetch it: `git lfs pull` in the folder that was cloned.")


def read_text(path: Path, most: int = LIMITS.text_bytes) -> str:
    """The text of a UTF-8 file, with or without a byte order mark."""
    return decode(path, read_bytes(path, most))


def decode(where: object, data: bytes) -> str:
    """UTF-8 bytes as text."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise BadInput(f"{where}, line {line}", "UTF-8 text", f"the byte 0x{data[error.start]:02x}") from None


def read_yaml(path: Path, limits: Limits = LIMITS) -> Any:
    """Plain data of a YAML file: no tags that construct objects, no deep nesting, no aliases that multiply."""
    return parse_yaml(path, read_text(path, limits.text_bytes), limits)


def parse_yaml(where: object, text: str, limits: Limits = LIMITS) -> Any:
    """Parse YAML from text; `where` names its place in a message."""
    try:
        _measure_yaml(where, text, limits)
        content = yaml.load(text, Loader=_DistinctKeys)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        place = f"{where}, line {mark.line + 1}" if mark else where
        raise BadInput(place, "YAML of plain values", str(getattr(error, "problem", None) or error)[:200]) from None
    except BadInput:
        raise
    except (ValueError, TypeError, RecursionError, OverflowError, AttributeError) as error:
        raise BadInput(where, "YAML of plain values", f"{type(error).__name__}: {error}"[:200]) from None
    count(where, content, limits)
    return content


class _DistinctKeys(yaml.SafeLoader):
    """YAML's safe loader, which takes the last of two like keys in silence, refusing them."""

    def compose_mapping_node(self, anchor: str | None) -> yaml.MappingNode:
        """The mapping as it stands in the text, before `<<` merges others into it."""
        node = super().compose_mapping_node(anchor)
        seen: set[tuple[str, str]] = set()
        for key, _ in node.value:
            if isinstance(key, yaml.ScalarNode):
                if (key.tag, key.value) in seen:
                    raise yaml.MarkedYAMLError(problem=f"the key {key.value!r} twice", problem_mark=key.start_mark)
                seen.add((key.tag, key.value))
        return node


def _measure_yaml(where: object, text: str, limits: Limits) -> None:
    """Refuse nesting before anything recursive reads it; the event parser keeps its stack on the heap."""
    depth = 0
    for event in yaml.parse(text, Loader=yaml.SafeLoader):
        if isinstance(event, yaml.CollectionStartEvent):
            depth += 1
            if depth > limits.depth:
                place = f"{where}, line {event.start_mark.line + 1}"
                raise BadInput(place, f"at most {limits.depth} levels of nesting", "more")
        elif isinstance(event, yaml.CollectionEndEvent):
            depth -= 1


def read_json(path: Path, limits: Limits = LIMITS) -> Any:
    """Plain data of a JSON file; NaN, infinities and keys that stand twice are refused."""
    return parse_json(path, read_text(path, limits.text_bytes), limits)


def parse_json(where: object, text: str, limits: Limits = LIMITS) -> Any:
    """Parse JSON from text; `where` names its place in a message."""

    def refuse(word: str) -> Any:
        raise BadInput(where, "JSON of finite numbers", word)

    def distinct(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        found = dict(pairs)
        if len(found) < len(pairs):
            (twice, _), *_ = Counter(key for key, _ in pairs).most_common(1)
            raise BadInput(where, "JSON with each key once", f"the key {twice!r:.80} twice")
        return found

    try:
        content = json.loads(text, parse_constant=refuse, object_pairs_hook=distinct)
    except RecursionError:
        raise BadInput(where, f"at most {limits.depth} levels of nesting", "more") from None
    except ValueError as error:
        raise BadInput(where, "JSON", f"text that is not ({str(error)[:120]})") from None
    count(where, content, limits)
    return content


def count(where: object, content: Any, limits: Limits = LIMITS) -> None:
    """Refuse plain data that is nested too deep or holds too many values, what is shared counted each time."""
    left = limits.nodes
    waiting: list[tuple[Any, int]] = [(content, 0)]
    while waiting:
        value, depth = waiting.pop()
        left -= 1
        if left < 0:
            raise BadInput(where, f"at most {limits.nodes:,} values", "more")
        if depth > limits.depth:
            raise BadInput(where, f"at most {limits.depth} levels of nesting", "more")
        if isinstance(value, dict):
            waiting.extend((inner, depth + 1) for pair in value.items() for inner in pair)
        elif isinstance(value, list | tuple | set | frozenset):
            waiting.extend((inner, depth + 1) for inner in value)


def members(where: object, archive: zipfile.ZipFile, limits: Limits = LIMITS) -> list[zipfile.ZipInfo]:
    """The files of an archive, after a look at what they say they unpack to."""
    found = [info for info in archive.infolist() if not info.filename.endswith("/")]  # is_dir() fails on an empty name
    if len(found) > limits.members:
        raise BadInput(where, f"at most {limits.members:,} files in an archive", f"{len(found):,}")
    total = sum(info.file_size for info in found)
    if total > limits.unpacked_bytes:
        raise BadInput(where, f"an archive that unpacks to at most {limits.unpacked_bytes:,} bytes", f"{total:,}")
    return found


def member_bytes(where: object, archive: zipfile.ZipFile, info: zipfile.ZipInfo, limits: Limits = LIMITS) -> bytes:
    """One file of an archive; what its header says is not believed further than `Limits`."""
    size = info.file_size
    if size > limits.unpacked_bytes:
        raise BadInput(where, f"at most {limits.unpacked_bytes:,} bytes unpacked", f"{size:,}")
    if size > limits.free_bytes and size > limits.ratio * max(info.compress_size, 1):
        raise BadInput(
            where, f"at most {limits.ratio:g} times its packed size", f"{size / max(info.compress_size, 1):.0f}"
        )
    try:
        with archive.open(info) as stream:
            data = stream.read(size + 1)
    except Exception as error:  # zipfile raises whatever its decompressors do; RuntimeError for a password
        raise BadInput(where, "a file that unpacks", f"{type(error).__name__}: {error}"[:160]) from None
    if len(data) > size:
        raise BadInput(where, f"{size:,} bytes, as the archive says", "more")
    refuse_pointer(where, data)
    return data


def npz_arrays(where: object, data: bytes, limits: Limits = LIMITS) -> dict[str, np.ndarray]:
    """The arrays of an .npz file; pickled objects are refused, and no header is believed about its size.

    Raises:
        BadInput: damaged, hostile or too large; an array whose bytes are not as many as its header says.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            found = members(where, archive, limits)
            return {
                info.filename.removesuffix(".npy"): npy_array(
                    f"{where}: {info.filename}", member_bytes(f"{where}: {info.filename}", archive, info, limits)
                )
                for info in found
            }
    except BadInput:
        raise
    except Exception as error:  # a damaged directory raises anything from BadZipFile to UnicodeDecodeError
        raise BadInput(where, "an .npz file of plain arrays", f"{type(error).__name__}: {error}"[:160]) from None


def npy_array(where: object, data: bytes) -> np.ndarray:
    """One array in NumPy's format; header and bytes must agree before anything is allocated."""
    stream = io.BytesIO(data)
    try:
        version = np.lib.format.read_magic(stream)
        read = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}[version]
        shape, fortran, dtype = read(stream)
        if dtype.hasobject:
            raise BadInput(where, "an array of numbers", "pickled objects", "Nothing of it was executed.")
        size = 1
        for length in shape:
            size *= int(length)
        rest = len(data) - stream.tell()
        if size * dtype.itemsize != rest:
            raise BadInput(where, f"the {size * dtype.itemsize:,} bytes of its header", f"{rest:,}")
        flat = np.frombuffer(data, dtype=dtype, count=size, offset=stream.tell())
        return flat.reshape(shape, order="F" if fortran else "C").copy()
    except BadInput:
        raise
    except Exception as error:  # NumPy's header parser evaluates a literal: any error of the parser may come
        raise BadInput(where, "a NumPy array", f"{type(error).__name__}: {error}"[:160]) from None


def require_real(where: object, values: np.ndarray) -> np.ndarray:
    """Numbers as float64; text, objects, complex numbers and times are refused."""
    if values.dtype.kind not in "biuf":
        kinds = {"c": "complex numbers", "U": "text", "S": "text", "O": "objects", "M": "dates", "m": "durations"}
        raise BadInput(where, "real numbers", kinds.get(values.dtype.kind, str(values.dtype)))
    return values.astype(np.float64)


def require_within(where: object, values: np.ndarray, most: float, unit: str = "") -> None:
    """Finite values of at most `most` in size; the message names the first row that is not."""
    with np.errstate(invalid="ignore"):
        bad = ~(np.abs(values) <= most)
    if bad.any():
        index = next(_true(bad))
        row = index[0] if index else 0
        raise BadInput(f"{where}, row {row}", f"finite numbers up to {most:g} {unit}".strip(), f"{values[index]:g}")


def _true(mask: np.ndarray) -> Iterator[tuple[int, ...]]:
    yield from (tuple(int(i) for i in index) for index in np.argwhere(mask)[:1])


def file_hash(path: Path) -> str:
    """sha256 of a file's bytes."""
    if not Path(path).is_file():  # a pipe would be waited for
        raise BadInput(path, "a file", "a folder" if Path(path).is_dir() else "none")
    try:
        with Path(path).open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except OSError as error:
        raise BadInput(path, "a file that can be read", error.strerror or str(error)) from None
