"""Which files below a folder, and which members of archives, are taken for motions."""

import os
from collections.abc import Iterator
from pathlib import Path

from bumblebee.motion.reading.archives import is_archive
from bumblebee.motion.reading.sources import Source, archive_sources, file_source

INDEX = "index.parquet"
# No motions: notes, licences, pictures.
_NO_MOTION = {"", ".txt", ".md", ".pdf", ".png", ".jpg", ".gif", ".mp4", ".html", ".json", ".yaml", ".yml", ".py"}


def motion_files(path: Path) -> list[Path]:
    """The files that `read_folder` tries, in its order."""
    return [path] if path.is_file() else list(_walk(path))


def motion_sources(path: Path) -> Iterator[Source]:
    """Sources to be read below a folder, or of a file: files, and the members of archives, in the order of names.

    An archive, or a member of one, that cannot be used is a source whose `read` says why.
    """
    for file in motion_files(path):
        if is_archive(file) and file.is_file():
            yield from archive_sources(file, _may_be_motion)
        else:
            yield file_source(file)


def _may_be_motion(name: Path) -> bool:
    """Whether a member is taken for a motion by its name; hidden files and macOS' own are not."""
    hidden = any(part.startswith(".") or part == "__MACOSX" for part in name.parts)
    return not hidden and name.suffix.lower() not in _NO_MOTION


def _walk(top: Path) -> Iterator[Path]:
    """The motion files below a folder, sorted; a motion library counts as one file, its index.

    Links to folders, which may lead in circles, and folders that cannot be listed come as they are: to be listed among
    what was skipped.
    """
    waiting = [top]
    while waiting:
        place = waiting.pop()
        try:
            entries = sorted((e for e in os.scandir(place) if not e.name.startswith(".")), key=lambda e: e.name)
        except OSError:
            yield place
            continue
        below = [Path(e.path) for e in entries if _is_folder(e)]
        names = {e.name for e in entries} - {p.name for p in below}
        if INDEX in names and place / "clips" in below:
            yield place / INDEX
            continue
        for entry in entries:
            path = Path(entry.path)
            link_to_folder = entry.is_symlink() and path.is_dir()
            if entry.name in names and (link_to_folder or path.suffix.lower() not in _NO_MOTION):
                yield path
        waiting += reversed(below)


def _is_folder(entry: os.DirEntry[str]) -> bool:
    try:
        return entry.is_dir(follow_symlinks=False)
    except OSError:
        return False
