"""Writing a library: anew, or going on where an earlier run, killed or finished, left it."""

import os
import shutil
import tempfile
from collections import Counter
from collections.abc import Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from itertools import groupby
from pathlib import Path
from types import TracebackType
from typing import Self

import pandas as pd

from bumblebee.errors import BadInput
from bumblebee.io import left_overs
from bumblebee.io.names import require_stem
from bumblebee.io.whole import put
from bumblebee.motion.checks import check_clips
from bumblebee.motion.clip import Clip
from bumblebee.motion.store.index import FILE, Row, read_places, row_of, write_index
from bumblebee.motion.store.place import is_shard, path_of
from bumblebee.motion.store.shard import (
    LEAST_CLIPS,
    MOST_CLIPS,
    MOST_FACTS,
    MOST_FRAMES,
    Shard,
    encoded,
    ends,
    name_of,
)


def write_library(folder: Path, clips: Iterable[Clip], skipped: pd.DataFrame | None = None) -> None:
    """Write a library, replacing what `folder` held; on any failure the folder stays as it was.

    Args:
        folder: where the library goes.
        clips: with distinct names; two shards of them are in memory at a time.
        skipped: columns `file`, `reason`.
    """
    folder = Path(os.path.abspath(folder))
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        left_overs.clear(folder)
        fresh = Path(tempfile.mkdtemp(prefix=left_overs.prefix(folder), suffix=".part", dir=folder.parent))
    except OSError as error:
        raise _unwritable(folder, error) from error
    try:
        fresh.chmod(0o755)
        with LibraryWriter(fresh) as writer:
            for clip in clips:
                writer.add(clip)
        (skipped if skipped is not None else _nothing()).to_csv(fresh / "skipped.csv", index=False)
        _swap(fresh, folder)
    except OSError as error:
        raise _unwritable(folder, error) from error
    finally:
        shutil.rmtree(fresh, ignore_errors=True)


class LibraryWriter:
    """Adds clips to a library in its place, shard by shard; one of a name that is there takes the other's place.

    `with LibraryWriter(folder) as writer:` and `writer.add(clip)`, one writer at a time. Whoever reads meanwhile, or
    after a kill, finds the library as it was before. The next writer takes over the shards that were finished: what
    `writer.has(...)` need not be made again. An exception leaves it the same way. A shard is written while the clips
    of the next one come.
    """

    def __init__(self, folder: Path) -> None:
        """Open a library, or begin one.

        Raises:
            BadInput: a damaged index, a library that was written before there were shards.
            OSError: a place that cannot be written.
        """
        self.folder = Path(os.path.abspath(folder))
        (self.folder / "clips").mkdir(parents=True, exist_ok=True)
        self._rows: dict[str, Row] = {}  # by name in lower case: a file system may not tell cases apart
        self._sizes: Counter[str] = Counter()  # clips of each shard
        self._added: set[str] = set()
        self._clips: list[Clip] = []
        self._frames = self._bytes = 0
        self._take_index()
        self._take_finished()
        self._thread = ThreadPoolExecutor(1)
        self._writing: Future[list[Row]] | None = None

    def __enter__(self) -> Self:
        """Itself."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None) -> None:
        """Finish the library, or leave it as it was where something went wrong."""
        try:
            if kind is None:
                self.close()
        finally:
            self._thread.shutdown()

    def has(self, name: str, sha256: str) -> bool:
        """Whether a clip of this name, from a source of this hash, is there already."""
        row = self._rows.get(name.casefold())
        return row is not None and (row["name"], row["sha256"]) == (name, sha256)

    def add(self, clip: Clip) -> None:
        """Add a clip; it is checked and written with its shard.

        Raises:
            BadInput: two of one name, a clip of an earlier shard that could not be read back.
            OSError: a full disk.
        """
        require_stem(f"{clip.source or 'a clip'}: name", clip.name)
        if clip.name.casefold() in self._added:
            raise BadInput(clip.source or clip.name, "distinct clip names", f"two clips named {clip.name!r}")
        size = sum(len(text) for text in (*clip.captions, clip.source, clip.licence)) + 400
        if self._clips and (self._frames + clip.frames > MOST_FRAMES or self._bytes + size > MOST_FACTS):
            self._end_shard()
        self._added.add(clip.name.casefold())
        self._clips.append(clip)
        self._frames += clip.frames
        self._bytes += size
        count = len(self._clips)
        if count >= MOST_CLIPS or (count >= LEAST_CLIPS and ends(clip.name)):
            self._end_shard()

    def close(self) -> None:
        """Write what is left, then the index, then remove the shards that it no longer names."""
        self._end_shard()
        self._collect()
        used = Counter(row["shard"] for row in self._rows.values())
        for shard in [name for name, count in used.items() if count < self._sizes[name]]:
            self._rewrite(shard)
        write_index(self.folder, self._rows.values())
        named = {row["shard"] for row in self._rows.values()}
        for path in (self.folder / "clips").iterdir():
            if path.name.endswith(".part") or (is_shard(path) and path.stem not in named):
                path.unlink()

    def _take_index(self) -> None:
        if os.path.lexists(self.folder / FILE):
            rows = read_places(self.folder).to_dict("records")
            if any(not row["shard"] for row in rows):
                came = "one file a clip, as libraries were before"
                raise BadInput(self.folder, "a library of shards to add to", came, "Write it anew.")
            self._take(rows)

    def _take_finished(self) -> None:
        """The shards of a writer that was killed, in the order in which they were written."""
        index = self.folder / FILE
        # One that is older than the index was replaced, and its writer was killed before it had removed it.
        oldest = index.stat().st_mtime_ns if index.exists() else -1
        others = [
            (made, path)
            for path in (self.folder / "clips").iterdir()
            if is_shard(path) and path.stem not in self._sizes and (made := path.stat().st_mtime_ns) > oldest
        ]
        for _, path in sorted(others):
            try:
                shard = Shard(path)
            except BadInput:
                continue  # `close` removes it
            shard.close()
            self._take([{**row, "shard": path.stem} for row in shard.rows()])

    def _take(self, rows: list[Row]) -> None:
        for row in rows:
            self._rows[row["name"].casefold()] = row
            self._sizes[row["shard"]] += 1

    def _end_shard(self) -> None:
        if self._clips:
            self._collect()
            self._writing = self._thread.submit(_written, self.folder, self._clips)
            self._clips, self._frames, self._bytes = [], 0, 0

    def _collect(self) -> None:
        if self._writing is not None:
            writing, self._writing = self._writing, None
            self._take(writing.result())

    def _rewrite(self, name: str) -> None:
        """The shard without the clips that others took the place of."""
        keys = [key for key, row in self._rows.items() if row["shard"] == name]
        keys.sort(key=lambda key: self._rows[key]["position"])
        shard, kept = Shard(path_of(self.folder, name)), []
        try:
            for group, own in groupby(keys, key=lambda key: shard.group(self._rows[key]["position"])):
                found = shard.clips([self._rows[key]["position"] for key in own], shard.read(group))
                for clip in found.values():
                    if isinstance(clip, BadInput):  # on this disk: nothing is dropped in silence
                        raise clip
                    kept.append(clip)
        finally:
            shard.close()
        self._take(_written(self.folder, kept))


def _written(folder: Path, clips: list[Clip]) -> list[Row]:
    """Write a shard; the rows of the index that say so."""
    check_clips([(f"{clip.source or 'a clip'}: {clip.name}", clip) for clip in clips])
    data = encoded(clips)
    shard = name_of(data)
    put(path_of(folder, shard), data)
    return [{**row_of(clip), "shard": shard, "position": position} for position, clip in enumerate(clips)]


def _nothing() -> pd.DataFrame:
    return pd.DataFrame(columns=["file", "reason"])


def _swap(fresh: Path, folder: Path) -> None:
    """Put `fresh` where `folder` is; renames only, so that no reader meets a half-written library."""
    old = folder.with_name(f"{left_overs.prefix(folder)}old")
    if folder.exists():
        os.rename(folder, old)
    try:
        os.rename(fresh, folder)
    except OSError:
        if old.exists():
            os.rename(old, folder)
        raise
    shutil.rmtree(old, ignore_errors=True)


def _unwritable(folder: Path, error: OSError) -> BadInput:
    remedy = "Free space on that disk or choose another folder." if error.errno == 28 else "Choose another folder."
    return BadInput(folder, "a folder that can be written", error.strerror or str(error), remedy)
