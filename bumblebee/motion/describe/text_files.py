"""HumanML3D's text files, in their archive or unpacked: listed at once, each read when it is asked for."""

import io
import os
import re
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from bumblebee.errors import BadInput
from bumblebee.io.limits import Limits
from bumblebee.io.read import decode, member_bytes, members, read_bytes

LIMITS = Limits(file_bytes=256 << 20, unpacked_bytes=1 << 30, members=1_000_000)
"""Limits of the archive: the published one has 11 MB, 17 MB unpacked, 29,232 files."""
_TEXT = Limits(unpacked_bytes=1 << 20)  # of one text; the longest published one has 2,760 bytes
_MAX_DIRECTORY = 128 << 20  # bytes of an archive's list of files; the published one's has 2 MB
_END = 22 + (1 << 16)  # bytes: the record at an archive's end with the longest comment
_NAME = re.compile(r"(M?\d{1,12})\.txt")
_PLACES = ("texts.zip", "texts", "HumanML3D/texts.zip", "HumanML3D/texts")


@dataclass(frozen=True)
class TextFiles:
    """Texts by name: `002510`, and `M002510` of the mirrored motion."""

    names: frozenset[str]
    notes: tuple[str, ...]
    _read: Callable[[str], tuple[str, bytes]]

    def read(self, name: str) -> list[tuple[str, str]]:
        """The lines of a text that are not blank, each with its place.

        Raises:
            BadInput: no such text, or one that is damaged, too large or no UTF-8.
        """
        if name not in self.names:
            raise BadInput(f"{name}.txt", "a text that the index names", "none")
        where, data = self._read(name)
        lines = enumerate(decode(where, data).splitlines(), 1)
        return [(f"{where}, line {number}", line.strip()) for number, line in lines if line.strip()]


def open_texts(folder: Path) -> TextFiles:
    """The texts of a folder with HumanML3D, as it is published or cloned: `texts.zip` or `texts/`.

    Raises:
        BadInput: neither is there, or a damaged archive.
    """
    for place in (folder / name for name in _PLACES):
        if place.is_dir():
            return _in_folder(place)
        if os.path.lexists(place):
            return _in_archive(place)
    raise BadInput(folder, "HumanML3D's texts.zip or a folder texts", "neither")


def _in_folder(place: Path) -> TextFiles:
    try:
        found = [match[1] for match in map(_NAME.fullmatch, os.listdir(place)) if match]
    except OSError as error:
        raise BadInput(place, "a folder that can be listed", error.strerror or str(error)) from None

    def read(name: str) -> tuple[str, bytes]:
        path = place / f"{name}.txt"
        return str(path), read_bytes(path, _TEXT.unpacked_bytes)

    return TextFiles(frozenset(found), (), read)


def _in_archive(place: Path) -> TextFiles:
    """An archive is held packed, in memory: what is read from it later is what was listed, whoever reads."""
    data = read_bytes(place, LIMITS.file_bytes)
    _require_short_directory(place, data)
    try:
        archive = zipfile.ZipFile(io.BytesIO(data))
    except Exception as error:  # a damaged directory raises anything from BadZipFile to UnicodeDecodeError
        raise BadInput(place, "a zip archive", f"{type(error).__name__}: {error}"[:160]) from None
    listed = members(place, archive, LIMITS)
    by_name: dict[str, zipfile.ZipInfo] = {}
    twice: set[str] = set()
    others = 0
    for info in listed:
        # Nothing is unpacked to the disk; a name that climbs out of its folder is none of ours, and never asked for.
        match = _NAME.fullmatch(info.filename.removeprefix("HumanML3D/").removeprefix("texts/"))
        if match is None:
            others += not info.filename.startswith("__MACOSX/")
        elif match[1] in by_name:
            twice.add(match[1])
        else:
            by_name[match[1]] = info
    notes = [f"{place}: {others} files in it that are no texts NNNNNN.txt: not read"] if others else []
    notes += (
        [f"{place}: {len(twice)} texts twice in it, the first {min(twice)}.txt: none of them read"] if twice else []
    )

    def read(name: str) -> tuple[str, bytes]:
        where = f"{place}/{by_name[name].filename}"
        return where, member_bytes(where, archive, by_name[name], _TEXT)

    return TextFiles(frozenset(by_name.keys() - twice), tuple(notes), read)


def _require_short_directory(place: Path, data: bytes) -> None:
    """Refuse an archive whose list of files is too long, before it is read; an archive in zip64 says so too."""
    end = data[-_END:]
    at = end.rfind(b"PK\x05\x06")
    length = int.from_bytes(end[at + 12 : at + 16], "little") if at >= 0 else 0
    if length > _MAX_DIRECTORY:
        raise BadInput(place, f"an archive with a list of files of at most {_MAX_DIRECTORY:,} bytes", f"{length:,}")
