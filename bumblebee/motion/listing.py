"""What lies at a path, file by file: motions of the robot, of people, clips of a library, or why a file gives none."""

import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

from bumblebee.errors import BadInput
from bumblebee.io.limits import LIMITS
from bumblebee.motion import walk
from bumblebee.motion.clip import Clip
from bumblebee.motion.formats.read import PICKLES, RobotConfig, is_robot_npz, read_robot
from bumblebee.motion.human.motion import HumanMotion
from bumblebee.motion.human.read import read_human
from bumblebee.motion.licence_table import LICENCES, stated_of
from bumblebee.motion.raw import RawMotion
from bumblebee.motion.sources import Source
from bumblebee.motion.store import Library
from bumblebee.motion.texts import shown

Motion = RawMotion | HumanMotion | Clip


@dataclass(frozen=True)
class Found:
    """One file, a member of an archive, or a clip of a library."""

    path: Path
    motions: tuple[Motion, ...] = ()
    reason: str = ""
    """Why there are no motions."""
    data: bytes = field(default=b"", repr=False)


@dataclass(frozen=True)
class Readers:
    """Who finds the files and who reads motions of people."""

    sources: Callable[[Path], Iterator[Source]]
    human: Callable[[Path, bytes], list[HumanMotion]] | None = None


def find_motions(path: Path, options: RobotConfig | None = None, readers: Readers | None = None) -> Iterator[Found]:
    """Each file at or below `path`, read when it is asked for; a bad one is a reason, and the next follows.

    Args:
        path: a file, a folder or a motion library.
        options: what files of robot motion may leave unsaid.
        readers: others than the usual.

    Raises:
        BadInput: nothing lies at `path`, or nothing that could be a motion.
    """
    path, options, readers = Path(path), options or RobotConfig(), readers or usual_readers()
    if not os.path.lexists(path):
        raise BadInput(path, "a motion file, or a folder that holds some", "no such file or folder")
    nothing = True
    for source in readers.sources(path):
        if source.path.name == LICENCES:
            continue
        nothing = False
        if source.path.name == walk.INDEX and source.archive is None:
            yield from _library(source.path.parent)
        else:
            yield _file(source, options, readers)
    if nothing:
        raise BadInput(path, "a motion file, or a folder that holds some", "none")


def usual_readers() -> Readers:
    """Files of folders, members of archives, libraries; people's motion with nothing set."""
    return Readers(walk.motion_sources, read_human)


def _file(source: Source, options: RobotConfig, readers: Readers) -> Found:
    data = b""
    try:
        data = source.read(LIMITS.file_bytes)
        suffix = source.path.suffix.lower()
        if suffix == ".csv" or suffix in PICKLES or (suffix == ".npz" and is_robot_npz(data)):
            found: list[Motion] = [*_robot(source.path, data, options)]
        elif readers.human is not None:
            found = [*readers.human(source.path, data)]
        else:
            found = [*read_robot(source.path, data, options)]  # which says what can be read
    except BadInput as error:
        return Found(source.path, reason=reason_of(error, source.path), data=data)
    except Exception as error:  # a mistake of ours about one file must not cost the user all the others
        said = shown(f"it could not be read ({type(error).__name__}: {error}): please report this")
        return Found(source.path, reason=said, data=data)
    return Found(source.path, tuple(found), data=data)


def _robot(path: Path, data: bytes, options: RobotConfig) -> list[RawMotion]:
    """Motions of the robot; the rate of a CSV file that was converted here stands in the table beside it."""
    stated = stated_of(path) if path.suffix.lower() == ".csv" else None
    if stated is None:
        return read_robot(path, data, options)
    return [replace(raw, rate_from=LICENCES) for raw in read_robot(path, data, replace(options, csv_fps=stated.fps))]


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
