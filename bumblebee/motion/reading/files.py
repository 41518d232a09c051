"""The files at a path, one after the other, and what came of each; the work on them goes to several processes."""

import hashlib
import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TypeVar

from bumblebee.errors import BadInput
from bumblebee.io.limits import LIMITS
from bumblebee.motion.clip import Clip
from bumblebee.motion.licences.table import LICENCES
from bumblebee.motion.reading.listing import csv_rate, reason_of
from bumblebee.motion.reading.ready import Job, Ready, Refused, make_ready
from bumblebee.motion.reading.settings import ReadConfig
from bumblebee.motion.reading.sources import Source
from bumblebee.motion.reading.walk import INDEX, motion_sources
from bumblebee.motion.side_by_side import in_order
from bumblebee.motion.store import Library
from bumblebee.motion.texts import shown

Result = TypeVar("Result")


@dataclass(frozen=True)
class File:
    """One source and what came of it: motions, or why there are none; a library's clips come as they are."""

    source: Source
    sha256: str = ""
    ready: tuple[Ready, ...] = ()
    refused: tuple[Refused, ...] = ()
    """Motions of a file of several that cannot be used."""
    clips: tuple[Clip, ...] = ()
    reason: str = ""
    place: Path | None = None
    """Place of a library's clip that gave none."""


def each_file(path: Path, config: ReadConfig, cache: Path | None) -> Iterator[File]:
    """Each file and what came of it, in order; the work on them goes to several processes."""
    work = partial(_worked, config=config, cache=cache)
    loaded = (_loaded(source, config) for source in motion_sources(path) if source.path.name != LICENCES)
    for done in in_order(work, loaded, config.processes):
        if done.source.path.name == INDEX and done.source.archive is None and not done.reason:
            yield from _library(done.source)
        else:
            yield done


@dataclass(frozen=True)
class _Loaded:
    """A source with its bytes, or why it has none; without `Source.read`, which does not go to other processes."""

    path: Path
    archive: Path | None
    data: bytes = b""
    csv_fps: float | None = None
    reason: str = ""


def _loaded(source: Source, config: ReadConfig) -> _Loaded:
    if source.path.name == INDEX and source.archive is None:
        return _Loaded(source.path, None)
    if source.path.is_dir():
        came = "a link to a folder, which is not followed" if source.path.is_symlink() else "one that cannot be listed"
        return _Loaded(source.path, source.archive, reason=f"expected a folder with motions, came {came}")
    data = tried(partial(source.read, LIMITS.file_bytes), source.path)
    if isinstance(data, str):
        return _Loaded(source.path, source.archive, reason=data)
    rate = _csv_fps(source, config)
    return _Loaded(source.path, source.archive, data, rate)


def _worked(loaded: _Loaded, config: ReadConfig, cache: Path | None) -> File:
    """File with its motions; never raises."""
    source = Source(loaded.path, _gone, loaded.archive)
    if loaded.reason or (loaded.path.name == INDEX and loaded.archive is None):
        return File(source, reason=loaded.reason)
    digest = hashlib.sha256(loaded.data).hexdigest()
    job = Job(loaded.path, loaded.data, digest, loaded.csv_fps, cache)
    found = tried(partial(make_ready, job, config), loaded.path)
    if isinstance(found, str):
        return File(source, digest, reason=found)
    ready = tuple(one for one in found if isinstance(one, Ready))
    refused = tuple(one for one in found if isinstance(one, Refused))
    return File(source, digest, ready, refused, reason="" if found else "no motion in it")


def _gone(most: int) -> bytes:
    raise AssertionError("the bytes were read before")


def _library(source: Source) -> Iterator[File]:
    """The clips of a library, and each damaged one by itself, so that it does not take the others with it."""
    library = tried(partial(Library, source.path.parent), source.path)
    if isinstance(library, str):
        yield File(source, reason=library)
        return
    whole = []
    for name, clip in library.each():
        if isinstance(clip, BadInput):
            reason = reason_of(clip, source.path)
            yield File(source, reason=reason, place=source.path.parent / name)
        else:
            whole.append(clip)
    yield File(source, clips=tuple(whole))


def _csv_fps(source: Source, config: ReadConfig) -> float | None:
    """The rate of a CSV file [Hz]: that of a folder by the settings, else as for every command (`csv_rate`)."""
    for folder in Path(os.path.realpath(source.path)).parents:
        if folder.name in config.csv_fps_by_folder:
            return config.csv_fps_by_folder[folder.name]
    return csv_rate(source, config)[0]


def tried(read: Callable[[], Result], file: Path) -> Result | str:
    """Result of `read`, or why there is none."""
    try:
        return read()
    except BadInput as error:
        return reason_of(error, file)
    except OSError as error:  # a file that vanished, a disk that was unplugged
        return shown(error.strerror or str(error))
    except Exception as error:  # a mistake of ours about one file must not cost the user all the others
        return shown(f"it could not be read ({type(error).__name__}: {error}): please report this")
