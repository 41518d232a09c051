"""Reads motions from a user's files: every format that is known, at one rate, on the floor, captioned, cut, hashed."""

import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import groupby
from pathlib import Path

import pandas as pd

from bumblebee.io.there import require_motions
from bumblebee.motion.captions import family_of
from bumblebee.motion.clip import Clip
from bumblebee.motion.describe.accounting import Account, account
from bumblebee.motion.describe.described import Described
from bumblebee.motion.describe.describer import Describer, describer
from bumblebee.motion.pieces import split_long
from bumblebee.motion.raw import RawMotion
from bumblebee.motion.reading.clips import clip_of
from bumblebee.motion.reading.few_lines import said_of
from bumblebee.motion.reading.file import File, tried
from bumblebee.motion.reading.naming import distinct
from bumblebee.motion.reading.nothing import nothing
from bumblebee.motion.reading.ready import each_file
from bumblebee.motion.reading.settings import ReadConfig
from bumblebee.motion.texts import shown

__all__ = ["ReadConfig", "Reading", "read_each", "read_file", "read_folder", "skipped_table"]


@dataclass(frozen=True)
class Reading:
    """Clips of a folder, the files without any, and what was detected rather than stated."""

    clips: list[Clip]
    skipped: pd.DataFrame
    """Columns `file`, `reason`."""
    notes: pd.DataFrame = field(default_factory=lambda: noted_table([]))
    """Columns `file`, `note`."""
    texts: Account | None = None
    """Where the captions come from, in counts that add up."""

    @property
    def skipped_lines(self) -> list[str]:
        """Few lines that say which files were skipped and why."""
        return said_of("skipped", zip(self.skipped["file"], self.skipped["reason"], strict=True))


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
    clips: list[Clip] = []
    return replace(read_each(path, clips.append, config, tell, cache), clips=clips)


def read_each(
    path: Path,
    take: Callable[[Clip], None],
    config: ReadConfig | None = None,
    tell: Callable[[], None] | None = None,
    cache: Path | None = None,
) -> Reading:
    """Read more motions than memory holds: `take` gets one clip after the other, and the reading has none."""
    path, config = Path(path), config or ReadConfig()
    require_motions(path)
    config.require_skeleton()
    say, heard = describer(config.describe, path), _Heard()
    count = 0
    for clip in distinct(_groups(path, config, cache, say, heard, tell or (lambda: None))):
        take(clip)
        count += 1
    if not count:
        do = "" if heard.skipped else "docs/data.md has the formats that are read."
        raise nothing(path, "motions that can be read", heard.skipped, do)
    return Reading([], skipped_table(heard.skipped), noted_table(heard.notes), account(say, heard.texts))


def read_file(path: Path, config: ReadConfig | None = None) -> list[Clip]:
    """The clips of one file that must be readable: of any format, an archive, or the index of a motion library."""
    return read_folder(path, config).clips


@dataclass
class _Heard:
    """Notes on the files while they are read."""

    skipped: list[tuple[str, str]] = field(default_factory=list)
    notes: list[tuple[str, str]] = field(default_factory=list)
    texts: list[Described] = field(default_factory=list)


def _groups(
    path: Path, config: ReadConfig, cache: Path | None, say: Describer, heard: _Heard, tell: Callable[[], None]
) -> Iterator[tuple[Path, list[Clip]]]:
    """The clips that belong together, with their file: the pieces of a motion, or those of a library."""
    root = path if path.is_dir() else path.parent
    numbered = enumerate(each_file(path, config, cache))
    for _, some in groupby(numbered, key=lambda one: one[1].library or one[0]):
        files = [file for _, file in some]
        if files[0].library:
            yield from _of_library(files[0].library, files, config)
        for file in files:
            name = shown(os.path.relpath(file.path, root))
            heard.skipped += [(name, file.reason)] if file.reason else []
            heard.skipped += [(f"{name}, {part}", reason) for part, reason in file.refused]
            for raw in [motion for motion in file.motions if isinstance(motion, RawMotion)]:
                said = say.captions(raw.file, raw.name, _seconds(raw), raw.amass_fps)
                made = tried(partial(_pieces, raw, file, said, config), file.path)
                if isinstance(made, str):
                    heard.skipped.append((name, made))
                    continue
                heard.texts.append(said)
                heard.notes += [(name, note) for note in (*raw.notes, *said.notes)]
                yield file.path, made
        tell()


def _of_library(index: Path, files: list[File], config: ReadConfig) -> Iterator[tuple[Path, list[Clip]]]:
    """The clips of a library, with its index: they have been read before, and are cut alone."""
    clips = [motion for file in files for motion in file.motions if isinstance(motion, Clip)]
    for group in _apart([split_long(clip, config.max_seconds) for clip in clips]):
        yield index, group


def _apart(clips: list[list[Clip]]) -> list[list[Clip]]:
    """A library's clips as one group, or each with its pieces as its own where cutting made equal names."""
    names = [clip.name.casefold() for pieces in clips for clip in pieces]
    return [[clip for pieces in clips for clip in pieces]] if len(set(names)) == len(names) else clips


def _pieces(raw: RawMotion, file: File, said: Described, config: ReadConfig) -> list[Clip]:
    return split_long(clip_of(raw, file, said, family_of(raw.name)), config.max_seconds)


def _seconds(raw: RawMotion) -> float:
    return (len(raw.root_pos) - 1) / raw.fps


def skipped_table(rows: list[tuple[str, str]]) -> pd.DataFrame:
    """Files without clips, columns `file` and `reason`."""
    return pd.DataFrame(rows, columns=["file", "reason"])


def noted_table(rows: list[tuple[str, str]]) -> pd.DataFrame:
    """Table of what was detected, columns `file` and `note`."""
    return pd.DataFrame(rows, columns=["file", "note"])
