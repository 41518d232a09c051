"""Reads motions from a user's files: every format that is known, at one rate, on the floor, captioned, cut, hashed."""

import hashlib
import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TypeVar

import pandas as pd

from bumblebee.errors import BadInput
from bumblebee.io.limits import LIMITS
from bumblebee.io.names import safe_stem
from bumblebee.motion.captions import family_of
from bumblebee.motion.checks import check_clip
from bumblebee.motion.clip import Clip
from bumblebee.motion.describe.accounting import Account, account
from bumblebee.motion.describe.described import Described
from bumblebee.motion.describe.describer import describer
from bumblebee.motion.kinematics import make_clip
from bumblebee.motion.licence_table import LICENCES, stated_of
from bumblebee.motion.licences import licence_of
from bumblebee.motion.listing import csv_rate
from bumblebee.motion.naming import distinct
from bumblebee.motion.pieces import split_long
from bumblebee.motion.ready import Job, Ready, make_ready, why_not
from bumblebee.motion.settings import ReadConfig
from bumblebee.motion.side_by_side import in_order
from bumblebee.motion.sources import Source
from bumblebee.motion.store import Library
from bumblebee.motion.texts import shown
from bumblebee.motion.walk import INDEX, motion_sources

__all__ = ["ReadConfig", "Reading", "read_file", "read_folder", "skipped_table"]

Result = TypeVar("Result")


@dataclass(frozen=True)
class Reading:
    """What a folder gave: the clips, the files without any, and what was detected rather than stated."""

    clips: list[Clip]
    skipped: pd.DataFrame
    """Columns `file`, `reason`."""
    notes: pd.DataFrame = field(default_factory=lambda: noted_table([]))
    """Columns `file`, `note`."""
    texts: Account | None = None
    """Where the captions come from, in counts that add up."""


@dataclass(frozen=True)
class _File:
    """One source and what came of it: motions, or why there are none; a library's clips come as they are."""

    source: Source
    sha256: str = ""
    ready: tuple[Ready, ...] = ()
    clips: tuple[Clip, ...] = ()
    reason: str = ""
    place: Path | None = None
    """Of a library's clip that gave none."""


def read_folder(
    path: Path, config: ReadConfig | None = None, tell: Callable[[], None] | None = None, cache: Path | None = None
) -> Reading:
    """All motions below `path`, in archives too; a file that cannot be used is listed and does not stop the others.

    Args:
        path: a folder, or a single file, which must then be readable.
        config: how the files are read.
        tell: called after each file.
        cache: folder in which retargeted motions are kept, by what they were made from.

    Raises:
        BadInput: no such folder, or no motion in it, or the single file cannot be used; texts that cannot be opened.
    """
    path, config = Path(path), config or ReadConfig()
    if not os.path.lexists(path):
        raise BadInput(path, "a folder with motion files, or a motion file", "no such folder or file")
    say = describer(config.describe, path)
    found: list[tuple[Path, list[Clip]]] = []
    skipped: list[tuple[str, str]] = []
    notes: list[tuple[str, str]] = []
    told: list[Described] = []
    files = 0
    for file in _files(path, config, cache):
        files += not file.place
        name = shown(os.path.relpath(file.place or file.source.path, path if path.is_dir() else path.parent))
        if file.reason:
            skipped.append((name, file.reason))
        groups = [
            (file.source.path, group) for group in _apart([split_long(c, config.max_seconds) for c in file.clips])
        ]
        for ready in file.ready:
            said = say.captions(ready.raw.file, ready.raw.name, _seconds(ready), ready.amass_fps)
            group = _tried(partial(_clips, ready, said, file, config), file.source.path)
            if isinstance(group, str):
                skipped.append((name, group))
                continue
            told.append(said)
            notes += [(name, note) for note in (*ready.raw.notes, *said.notes)]
            groups.append((file.source.path, group))
        found += groups
        if tell and not file.place:
            tell()
    clips = distinct(found)
    if not clips:
        raise _nothing(path, files, skipped)
    return Reading(clips, skipped_table(skipped), noted_table(notes), account(say, told))


def read_file(path: Path, config: ReadConfig | None = None) -> list[Clip]:
    """The clips of one file that must be readable: of any format, an archive, or the index of a motion library."""
    return read_folder(path, config).clips


def _files(path: Path, config: ReadConfig, cache: Path | None) -> Iterator[_File]:
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
    data = _tried(partial(source.read, LIMITS.file_bytes), source.path)
    if isinstance(data, str):
        return _Loaded(source.path, source.archive, reason=data)
    rate = _csv_fps(source, config)
    return _Loaded(source.path, source.archive, data, rate)


def _worked(loaded: _Loaded, config: ReadConfig, cache: Path | None) -> _File:
    """What a file holds; never raises."""
    source = Source(loaded.path, _gone, loaded.archive)
    if loaded.reason or (loaded.path.name == INDEX and loaded.archive is None):
        return _File(source, reason=loaded.reason)
    digest = hashlib.sha256(loaded.data).hexdigest()
    job = Job(loaded.path, loaded.data, digest, loaded.csv_fps, cache)
    ready = _tried(partial(make_ready, job, config), loaded.path)
    if isinstance(ready, str):
        return _File(source, digest, reason=ready)
    return _File(source, digest, tuple(ready), reason="" if ready else "no motion in it")


def _gone(most: int) -> bytes:
    raise AssertionError("the bytes were read before")


def _library(source: Source) -> Iterator[_File]:
    """The clips of a library, and each damaged one by itself, so that it does not take the others with it."""
    library = _tried(partial(Library, source.path.parent), source.path)
    if isinstance(library, str):
        yield _File(source, reason=library)
        return
    whole = []
    for name, clip in library.each():
        if isinstance(clip, BadInput):
            reason = shown(why_not(clip, source.path), 1000)
            yield _File(source, reason=reason, place=source.path.parent / name)
        else:
            whole.append(clip)
    yield _File(source, clips=tuple(whole))


def _apart(clips: list[list[Clip]]) -> list[list[Clip]]:
    """A library's clips as one group, or each with its pieces as its own where cutting made equal names."""
    names = [clip.name.casefold() for pieces in clips for clip in pieces]
    return [[clip for pieces in clips for clip in pieces]] if len(set(names)) == len(names) else clips


def _clips(ready: Ready, said: Described, file: _File, config: ReadConfig) -> list[Clip]:
    """A motion with its texts, licence and keypoints, cut."""
    raw = ready.raw
    before = stated_of(raw.file) if file.source.archive is None else None
    clip = make_clip(
        safe_stem(raw.name, "motion"),
        raw.fps,
        raw.root_pos,
        raw.root_quat,
        raw.joint_pos,
        captions=said.captions,
        caption_source=said.source,
        source=before.source if before else shown(str(Path(raw.file.parent.name) / raw.file.name)),
        licence=before.licence if before else licence_of(file.source),
        sha256=file.sha256,
        family=family_of(raw.name),
    )
    check_clip(raw.where, clip)
    return split_long(clip, config.max_seconds)


def _seconds(ready: Ready) -> float:
    return (len(ready.raw.root_pos) - 1) / ready.raw.fps


def _csv_fps(source: Source, config: ReadConfig) -> float | None:
    """The rate of a CSV file [Hz]: that of a folder by the settings, else as for every command (`csv_rate`)."""
    for folder in Path(os.path.realpath(source.path)).parents:
        if folder.name in config.csv_fps_by_folder:
            return config.csv_fps_by_folder[folder.name]
    return csv_rate(source, config)[0]


def _tried(read: Callable[[], Result], file: Path) -> Result | str:
    """What `read` returns, or why it does not."""
    try:
        return read()
    except BadInput as error:
        return shown(why_not(error, file), 1000)
    except OSError as error:  # a file that vanished, a disk that was unplugged
        return shown(error.strerror or str(error))
    except Exception as error:  # a mistake of ours about one file must not cost the user all the others
        return shown(f"it could not be read ({type(error).__name__}: {error}): please report this")


def _nothing(path: Path, files: int, skipped: list[tuple[str, str]]) -> BadInput:
    if not path.is_dir() and len(skipped) == 1:
        return BadInput(path, "motions that can be read", skipped[0][1])
    first = f"; the first: {skipped[0][0]}: {skipped[0][1]}" if skipped else ""
    return BadInput(path, "motions that can be read", f"{files} files, none of them usable{first}")


def skipped_table(rows: list[tuple[str, str]]) -> pd.DataFrame:
    """Files without clips, columns `file` and `reason`."""
    return pd.DataFrame(rows, columns=["file", "reason"])


def noted_table(rows: list[tuple[str, str]]) -> pd.DataFrame:
    """What was detected, columns `file` and `note`."""
    return pd.DataFrame(rows, columns=["file", "note"])
