"""List of a path, file by file: motions of the robot, of people, clips of a library, or why a file gives none."""

import os
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

from bumblebee.errors import BadInput
from bumblebee.io.limits import LIMITS
from bumblebee.motion.clip import Clip
from bumblebee.motion.human.motion import HumanMotion, Role
from bumblebee.motion.human.skeleton import UnknownSkeleton
from bumblebee.motion.licences.of_files import licence_of, stated_rate
from bumblebee.motion.licences.table import LICENCES, stated_of
from bumblebee.motion.raw import RawMotion
from bumblebee.motion.reading import walk
from bumblebee.motion.reading.one_file import FileConfig, read_one
from bumblebee.motion.reading.sources import Source
from bumblebee.motion.store import Library
from bumblebee.motion.texts import shown

Motion = RawMotion | HumanMotion | Clip
_DO = "docs/data.md has the formats that are read."


@dataclass(frozen=True)
class Found:
    """One file, a member of an archive, or a clip of a library."""

    path: Path
    motions: tuple[Motion, ...] = ()
    reason: str = ""
    """Why there are no motions."""
    data: bytes = field(default=b"", repr=False)
    source: Source | None = None
    """Where the bytes come from; None for a clip of a library."""
    skeleton: tuple[Role, ...] = ()
    """For a file that is refused for its skeleton: the joints that were found for the landmarks."""

    @property
    def licence(self) -> str:
        """That of the file: of the table beside it where it was converted here, else as `licence_of` finds it."""
        before = stated_of(self.path) if self.source is None or self.source.archive is None else None
        return before.licence if before else licence_of(self.source or self.path)


def find_motions(path: Path, config: FileConfig | None = None) -> Iterator[Found]:
    """Each file at or below `path`, read when it is asked for; a bad one is a reason, and the next follows.

    Args:
        path: a file, a folder or a motion library.
        config: what files may leave unsaid.

    Raises:
        BadInput: nothing lies at `path`, or nothing that could be a motion; a mapping of joints that is none.
    """
    path, config = Path(path), config or FileConfig()
    config.require_skeleton()
    if not os.path.lexists(path):
        raise BadInput(path, "a motion file, or a folder that holds some", "no such file or folder", _DO)
    nothing = True
    for source in walk.motion_sources(path):
        if source.path.name == LICENCES:
            continue
        nothing = False
        if source.path.name == walk.INDEX and source.archive is None:
            yield from _library(source.path.parent)
        else:
            yield _file(source, config)
    if nothing:
        raise BadInput(path, "a motion file, or a folder that holds some", "none", _DO)


def _file(source: Source, config: FileConfig) -> Found:
    data = b""
    try:
        data = source.read(LIMITS.file_bytes)
        rate, rate_from = csv_rate(source, config)
        found = read_one(source.path, data, replace(config, csv_fps=rate))
    except BadInput as error:
        roles = error.roles if isinstance(error, UnknownSkeleton) else ()
        return Found(source.path, reason=reason_of(error, source.path), data=data, skeleton=roles)
    except Exception as error:  # a mistake of ours about one file must not cost the user all the others
        said = shown(f"it could not be read ({type(error).__name__}: {error}): please report this")
        return Found(source.path, reason=said, data=data)
    if rate_from:
        found = [replace(raw, rate_from=rate_from) if isinstance(raw, RawMotion) else raw for raw in found]
    return Found(source.path, tuple(found), data=data, source=source)


def csv_rate(source: Source, config: FileConfig) -> tuple[float | None, str]:
    """The rate of a CSV file [Hz] and who says it: LICENCES.csv beside it, the settings, SOURCES.md; else None, ""."""
    if source.path.suffix.lower() != ".csv":
        return config.csv_fps, ""
    stated = stated_of(source.path) if source.archive is None else None
    if stated is not None:
        return stated.fps, LICENCES
    if config.csv_fps is not None:
        return config.csv_fps, ""
    rate = stated_rate(source)
    return rate, "SOURCES.md" if rate else ""


def _library(folder: Path) -> Iterator[Found]:
    """The clips of a library, each by itself: a damaged one does not take the others with it."""
    path = folder / walk.INDEX
    try:
        library = Library(folder)
    except BadInput as error:
        yield Found(path, reason=reason_of(error, path))
        return
    for name, clip in library.each():
        if isinstance(clip, BadInput):
            yield Found(folder / name, reason=reason_of(clip, folder))
        else:
            yield Found(folder / name, (clip,))


def reason_of(error: BadInput, path: Path) -> str:
    """An error's line without the file's name, which stands beside it."""
    return shown(str(error).removeprefix(str(path)).lstrip(":, "), 1000)
