"""Where a motion's bytes come from: a file, or a member of an archive."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from bumblebee.io.read import read_bytes
from bumblebee.motion.reading.archives import climbs_out, list_archive
from bumblebee.motion.texts import shown


@dataclass(frozen=True)
class Source:
    """One motion file to be read, on disk or in an archive."""

    path: Path
    """As it is shown, and by whose name and suffix it is read; a member: the archive's path joined with its name."""
    read: Callable[[int], bytes]
    """Its bytes; refuses (BadInput) more than the given number of them."""
    archive: Path | None = None
    """The archive that it is a member of."""


def file_source(path: Path) -> Source:
    """A file on disk."""
    return Source(path, partial(read_bytes, path))


def archive_sources(path: Path, is_motion: Callable[[Path], bool]) -> Iterator[Source]:
    """The motions in an archive, and what is wrong with it or its members: a source that can only refuse.

    Args:
        path: the archive.
        is_motion: whether a member of that name is asked for.
    """
    for member in list_archive(path):
        name = Path(shown(member.name.replace("\\", "/"), 1000))
        if not member.name:
            yield Source(path, member.read, path)
        elif climbs_out(member.name):
            # The place that is shown must not climb either.
            yield Source(path / ("" if name.name == ".." else name.name), member.read, path)
        elif is_motion(name):
            yield Source(path / name, member.read, path)
