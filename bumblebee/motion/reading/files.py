"""The files at a path, one after the other, each with its bytes or why it has none, for all that reads motions."""

import hashlib
import os
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

from bumblebee.errors import BadInput
from bumblebee.io.limits import LIMITS
from bumblebee.motion.human.motion import HumanMotion, Role
from bumblebee.motion.human.skeleton import UnknownSkeleton
from bumblebee.motion.licences.of_files import stated_rate
from bumblebee.motion.licences.table import LICENCES, stated_of
from bumblebee.motion.raw import RawMotion
from bumblebee.motion.reading.file import File, reason_of, tried
from bumblebee.motion.reading.one_file import FileConfig, read_one
from bumblebee.motion.reading.sources import Source
from bumblebee.motion.reading.walk import INDEX, motion_sources
from bumblebee.motion.store import Library

_DO = "docs/data.md has the formats that are read."


def opened(path: Path, config: FileConfig) -> Iterator[File]:
    """Each file at or below `path` with its bytes, or why it has none; a library by its index, without bytes."""
    for source in motion_sources(path):
        if source.path.name == LICENCES:
            continue
        if source.path.name == INDEX and source.archive is None:
            yield File(source.path, library=source.path)
        else:
            yield _opened(source, config)


def find_motions(path: Path, config: FileConfig | None = None) -> Iterator[File]:
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
    for file in opened(path, config):
        nothing = False
        yield from clips_of(file) if file.library else [with_motions(file, config)]
    if nothing:
        raise BadInput(path, "a motion file, or a folder that holds some", "none", _DO)


def with_motions(file: File, config: FileConfig) -> File:
    """The file with its motions at their own rates, unchecked, in the place of its bytes; never raises."""
    if file.reason:
        return file
    roles: list[Role] = []

    def read() -> list[RawMotion | HumanMotion]:
        try:
            return read_one(file.path, file.data, replace(config, csv_fps=file.csv_fps))
        except UnknownSkeleton as error:
            roles.extend(error.roles)
            raise

    found = tried(read, file.path)
    if isinstance(found, str):
        return replace(file, data=b"", reason=found, skeleton=tuple(roles))
    if file.rate_from:
        found = [replace(raw, rate_from=file.rate_from) if isinstance(raw, RawMotion) else raw for raw in found]
    return replace(file, data=b"", motions=tuple(found))


def clips_of(library: File) -> Iterator[File]:
    """The clips of a library, each by itself: a damaged one does not take the others with it."""
    index = library.path
    held = tried(partial(Library, index.parent), index)
    if isinstance(held, str):
        yield replace(library, reason=held)
        return
    for name, clip in held.each():
        place = File(index.parent / name, library=index)
        yield (
            replace(place, reason=reason_of(clip, index.parent))
            if isinstance(clip, BadInput)
            else replace(place, motions=(clip,))
        )


def _opened(source: Source, config: FileConfig) -> File:
    file = File(source.path, source.archive)
    if source.path.is_dir():
        came = "a link to a folder, which is not followed" if source.path.is_symlink() else "one that cannot be listed"
        return replace(file, reason=f"expected a folder with motions, came {came}")
    data = tried(partial(source.read, LIMITS.file_bytes), source.path)
    if isinstance(data, str):
        return replace(file, reason=data)
    rate, rate_from = _csv_rate(source, config)
    digest = hashlib.sha256(data).hexdigest()
    return replace(file, data=data, sha256=digest, csv_fps=rate, rate_from=rate_from)


def _csv_rate(source: Source, config: FileConfig) -> tuple[float | None, str]:
    """The rate of a CSV file [Hz] and who says it: its folder's, LICENCES.csv beside it, SOURCES.md; settings: ""."""
    if source.path.suffix.lower() != ".csv":
        return config.csv_fps, ""
    if (rate := config.rate_below(Path(os.path.realpath(source.path)))) is not None:
        return rate, ""
    stated = stated_of(source.path) if source.archive is None else None
    if stated is not None:
        return stated.fps, LICENCES
    if config.csv_fps is not None:
        return config.csv_fps, ""
    rate = stated_rate(source.path, source.archive)
    return rate, "SOURCES.md" if rate else ""
