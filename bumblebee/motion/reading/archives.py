"""The members of zip and tar archives, each read when it is asked for; nothing is ever unpacked to disk.

Names, sizes and kinds that an archive states are not believed further than `ARCHIVE`. What is wrong with a member costs
that member only: its `read` says so.
"""

import bz2
import gzip
import io
import re
import stat
import tarfile
import threading
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from pathlib import Path, PurePosixPath
from typing import IO, NoReturn

from bumblebee.errors import BadInput
from bumblebee.io.limits import LIMITS
from bumblebee.io.read import member_bytes, open_file, refuse_pointer
from bumblebee.motion.texts import shown

SUFFIXES = (".zip", ".tar", ".tar.gz", ".tgz", ".tar.bz2", ".tbz2")  # AMASS comes as .tar.bz2
ARCHIVE = replace(LIMITS, unpacked_bytes=64 << 30, members=250_000)
"""Limits of an archive: its members are read one by one, so that together they may be more than memory holds."""
_MAX_DIRECTORY = 64 << 20  # bytes of a zip's list of members
_END = 22 + (1 << 16) + 76  # bytes at a zip's end: the record with the longest comment, and that of zip64
_CHUNK = 1 << 20
_MAX_READ = 16 << 20  # bytes that a tar's header may ask for: an extended one has some hundred
_AGAIN = "Copy the archive again."


@dataclass(frozen=True)
class Member:
    """One entry of an archive that is no folder; `name` is that of the archive itself where all of it is bad."""

    name: str
    read: Callable[[int], bytes]
    """Its bytes; refuses (BadInput) more than the given number of them, and whatever is wrong with it."""
    bad: bool = False
    """Whether `read` can only refuse."""


def is_archive(path: Path) -> bool:
    """Whether a file's name is that of an archive."""
    return path.name.lower().endswith(SUFFIXES)


def climbs_out(name: str) -> bool:
    """Whether a member's name leads out of its archive, on any system."""
    plain = name.replace("\\", "/")
    return ".." in plain.split("/") or plain.startswith("/") or re.match(r"[A-Za-z]:", plain) is not None


def list_archive(path: Path) -> list[Member]:
    """The members, a zip's by name, a tar's in their order; what is wrong with the archive is a bad member "".

    Two members of one name are one bad member: nobody can know which is meant.
    """
    try:
        facts = path.stat()
    except OSError as error:
        return [_bad("", path, "an archive that can be read", error.strerror or str(error))]
    return list(_listed(path, facts.st_mtime_ns, facts.st_size))


@lru_cache(maxsize=4)
def _listed(path: Path, changed: int, size: int) -> tuple[Member, ...]:
    """The members as of the time and size at which the archive was last changed."""
    try:
        open_file(path, size).close()
    except BadInput as error:  # no regular file, or one that stands for it
        return (_bad("", path, error.expected, error.came, error.do),)
    found = _zip(path, changed, size) if path.suffix.lower() == ".zip" else _tar(path, changed, size)
    listed: dict[tuple[str, ...], Member] = {}
    for member in found:
        key = PurePosixPath(member.name.replace("\\", "/")).parts
        if key in listed and key:
            where = _shown(path, member.name)
            listed[key] = _bad(member.name, where, "one member of each name", "two", "Rename one.")
        else:
            listed[key] = member
    return tuple(listed.values())


def _bad(name: str, where: object, expected: str, came: str, do: str = "") -> Member:
    return Member(name, partial(_refuse, str(where), expected, came, do), bad=True)


def _refuse(where: str, expected: str, came: str, do: str, most: int) -> NoReturn:
    """Refuse a bad member."""
    raise BadInput(where, expected, came, do)


def _shown(path: Path, name: str) -> Path:
    return path / shown(name, 200) if name else path


def _checked(path: Path, name: str, mode: int, read: Callable[[int], bytes]) -> Member:
    """A member, bad where its name or kind is one that no motion has."""
    where = _shown(path, name)
    if climbs_out(name):
        return _bad(
            name, f"{path}, member {shown(name, 200)!r}", "a name within the archive", "one that climbs out of it"
        )
    if stat.S_IFMT(mode) not in (0, stat.S_IFREG):
        return _bad(name, where, "a file", "a link" if stat.S_ISLNK(mode) else "a device or pipe")
    if is_archive(Path(name)):
        return _bad(name, where, "a file that is no archive", "an archive in an archive", "Unpack it.")
    return Member(name, read)


def _zip(path: Path, changed: int, size: int) -> Iterator[Member]:
    try:
        infos = _opened_zip(path, changed, size).infolist()
    except BadInput as error:
        yield _bad("", path, error.expected, error.came, error.do)
        return
    except Exception as error:  # a damaged directory raises anything from BadZipFile to UnicodeDecodeError
        yield _bad("", path, "a whole zip archive", f"{type(error).__name__}: {error}"[:120], _AGAIN)
        return
    total = sum(info.file_size for info in infos)
    if len(infos) > ARCHIVE.members or total > ARCHIVE.unpacked_bytes:
        wanted = f"at most {ARCHIVE.members:,} members of {ARCHIVE.unpacked_bytes:,} bytes together"
        yield _bad("", path, wanted, f"{len(infos):,} of {total:,}", "Unpack it.")
        return
    for index, info in sorted(enumerate(infos), key=lambda pair: pair[1].filename):
        if info.filename.endswith("/"):
            continue
        if not info.filename:
            yield _bad("", path, "members with names", "one without", _AGAIN)
        elif info.flag_bits & 1:
            yield _bad(
                info.filename, _shown(path, info.filename), "a member without password", "one with", "Unpack it."
            )
        else:
            read = partial(_read_zip, path, changed, size, index)
            yield _checked(path, info.filename, info.external_attr >> 16, read)


@lru_cache(maxsize=4)
def _opened_zip(path: Path, changed: int, size: int) -> zipfile.ZipFile:
    """The archive, open as long as it is among the last that were used: its list is read once, not for each member."""
    with path.open("rb") as stream:
        stream.seek(max(0, size - _END))
        end = stream.read(_END)
    at, large = end.rfind(b"PK\x05\x06"), end.rfind(b"PK\x06\x06")
    listed = int.from_bytes(end[at + 12 : at + 16], "little") if at >= 0 else 0
    if listed == 0xFFFFFFFF and large >= 0:
        listed = int.from_bytes(end[large + 40 : large + 48], "little")
    if at < 0:
        raise BadInput(path, "a whole zip archive", "one without its end", _AGAIN)
    if listed > _MAX_DIRECTORY:
        raise BadInput(path, f"a list of members of at most {_MAX_DIRECTORY:,} bytes", f"{listed:,}", "Unpack it.")
    return zipfile.ZipFile(path)


def _read_zip(path: Path, changed: int, size: int, index: int, most: int) -> bytes:
    try:
        archive = _opened_zip(path, changed, size)
        info = archive.infolist()[index]
    except Exception as error:  # it was whole when it was listed
        raise BadInput(path, "the archive that was listed", f"another ({type(error).__name__})") from None
    where = _shown(path, info.filename)
    if info.file_size > most:
        raise BadInput(where, f"at most {most:,} bytes", f"{info.file_size:,}")
    data = member_bytes(where, archive, info)
    if len(data) != info.file_size:
        raise BadInput(where, f"{info.file_size:,} bytes, as the archive says", f"{len(data):,}", _AGAIN)
    return data


class _Stream(io.RawIOBase):
    """A tar's bytes, unpacked; a header that asks for more than any has is refused before memory is given to it."""

    def __init__(self, file: IO[bytes] | bz2.BZ2File | gzip.GzipFile) -> None:
        self.file, self.lock = file, threading.Lock()

    def read(self, size: int = -1) -> bytes:
        """Bytes from here on."""
        if not 0 <= size <= _MAX_READ:
            raise tarfile.ReadError(f"a header of {size:,} bytes")
        return self.file.read(size)

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        """Go to a place; backwards in a packed file means from its start."""
        return self.file.seek(offset, whence)

    def tell(self) -> int:
        """The place."""
        return self.file.tell()


def _tar_stream(path: Path) -> _Stream:
    kind = path.suffix.lower()
    if kind == ".tar":
        return _Stream(path.open("rb"))
    return _Stream(bz2.BZ2File(path) if kind in (".bz2", ".tbz2") else gzip.GzipFile(path))


@lru_cache(maxsize=4)
def _opened_tar(path: Path, changed: int, size: int) -> _Stream:
    """The archive, open as long as it is among the last that were used: members in their order are read in one go."""
    return _tar_stream(path)


def _tar(path: Path, changed: int, size: int) -> Iterator[Member]:
    count = 0
    try:
        stream = _tar_stream(path)
        with stream.file, tarfile.open(fileobj=stream, mode="r:") as archive:
            for info in archive:
                vars(archive)["members"] = []  # else it keeps them all
                count += 1
                end = info.offset_data + info.size
                if count > ARCHIVE.members or end > ARCHIVE.unpacked_bytes:
                    wanted = f"at most {ARCHIVE.members:,} members of {ARCHIVE.unpacked_bytes:,} bytes together"
                    yield _bad("", path, wanted, "more", "Unpack it.")
                    return
                if not info.isdir():
                    read = partial(_read_tar, path, changed, size, info.name, info.offset_data, info.size)
                    yield _checked(path, info.name, _mode(info), read)
            stream.seek(archive.offset)
            # tarfile takes a damaged header for the end.
            if stream.read(tarfile.BLOCKSIZE) != bytes(tarfile.BLOCKSIZE):
                raise tarfile.ReadError("no end where it should be")
    except Exception as error:  # tarfile, gzip and zlib have errors of three families
        came = f"{count} members, then {type(error).__name__}: {error}"[:120]
        yield _bad("", path, "a whole tar archive", came, _AGAIN)


def _mode(info: tarfile.TarInfo) -> int:
    """A member's kind as in a file's mode; what tar alone knows (sparse files) counts as a device."""
    if info.issym() or info.islnk():
        return stat.S_IFLNK
    return stat.S_IFREG if info.isreg() and not info.issparse() else stat.S_IFCHR


def _read_tar(path: Path, changed: int, size: int, name: str, start: int, length: int, most: int) -> bytes:
    where = _shown(path, name)
    if length > most:
        raise BadInput(where, f"at most {most:,} bytes", f"{length:,}")
    stream = _opened_tar(path, changed, size)
    parts: list[bytes] = []
    try:
        with stream.lock:
            stream.seek(start)
            left = length
            while left and (part := stream.read(min(left, _CHUNK))):
                parts.append(part)
                left -= len(part)
    except Exception as error:  # gzip raises zlib's errors as they are
        raise BadInput(where, "a member that unpacks", f"{type(error).__name__}: {error}"[:120], _AGAIN) from None
    if left:
        raise BadInput(where, f"{length:,} bytes, as the archive says", f"{length - left:,}", _AGAIN)
    data = b"".join(parts)
    refuse_pointer(where, data)
    return data
