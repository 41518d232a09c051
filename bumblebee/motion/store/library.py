"""Reading a library: one clip, some in an order of one's own, or all one after the other without holding them."""

import threading
from collections import OrderedDict
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import groupby
from pathlib import Path

import numpy as np
import pandas as pd

from bumblebee.errors import BadInput
from bumblebee.motion.clip import Clip
from bumblebee.motion.store.index import FILE, INDEX_COLUMNS, Row, read_places
from bumblebee.motion.store.one_file import read_clip
from bumblebee.motion.store.place import path_of
from bumblebee.motion.store.shard import GROUP_CLIPS, Shard

_TOLD_TWICE = ("name", "family", "split", "source", "licence", "sha256", "frames", "caption_source")
_OPEN = 64  # shards that stay open: some 30 MB

Read = Clip | BadInput


class Library:
    """A library whose clips are read when they are asked for.

    `len`, `name in library`, `library[name]`, iteration in the index's order (the next clips are unpacked meanwhile),
    and `library.index`, the table of `read_index`. Some sixteen clips are in memory at a time.
    """

    def __init__(self, folder: Path) -> None:
        """Read the index.

        Raises:
            BadInput: no library, or a damaged index.
        """
        self.folder = Path(folder)
        places = read_places(self.folder)
        self.index: pd.DataFrame = places[list(INDEX_COLUMNS)]
        self._rows: list[Row] = places.to_dict("records")
        self._row_of = {row["name"]: number for number, row in enumerate(self._rows)}
        self._open: OrderedDict[str, Shard] = OrderedDict()
        self._last: tuple[str, int, np.ndarray] = ("", -1, np.zeros((0, 0)))
        self._lock = threading.Lock()

    def __len__(self) -> int:
        """How many clips the index names."""
        return len(self._rows)

    def __contains__(self, name: object) -> bool:
        """Whether a clip has this name."""
        return name in self._row_of

    def __iter__(self) -> Iterator[Clip]:
        """All clips in the index's order; the first damaged one raises `BadInput`."""
        for _, clip in self.each():
            if isinstance(clip, BadInput):
                raise clip
            yield clip

    def __getitem__(self, name: str) -> Clip:
        """The clip of this name; for several, `select` unpacks less.

        Raises:
            BadInput: there is none, or it is damaged.
        """
        (clip,) = self.select([name])
        return clip

    @property
    def names(self) -> list[str]:
        """Names of all clips, in order."""
        return list(self._row_of)

    def each(self, numbers: Sequence[int] | None = None) -> Iterator[tuple[str, Read]]:
        """(name, clip) in the index's order, or of those rows; a damaged clip comes as its `BadInput`."""
        rows = [self._rows[number] for number in numbers] if numbers is not None else self._rows
        runs = (list(run) for _, run in groupby(rows, key=lambda row: row["shard"]))
        batches = (run[start : start + GROUP_CLIPS] for run in runs for start in range(0, len(run), GROUP_CLIPS))
        with ThreadPoolExecutor(1) as ahead:
            waiting = None
            for batch in batches:
                following = ahead.submit(self._read, batch)
                if waiting is not None:
                    yield from waiting.result()
                waiting = following
            if waiting is not None:
                yield from waiting.result()

    def select(self, names: Sequence[str]) -> list[Clip]:
        """The named clips, in that order.

        Raises:
            BadInput: a name that no clip has, a damaged clip.
        """
        for name in names:
            if name not in self._row_of:
                raise BadInput(self.folder / FILE, f"a clip named {name!r}", f"{len(self)} clips without it")
        numbers = sorted({self._row_of[name] for name in names})
        found: dict[str, Clip] = {}
        for name, clip in self._read([self._rows[number] for number in numbers]):
            if isinstance(clip, BadInput):
                raise clip
            found[name] = clip
        return [found[name] for name in names]

    def _read(self, rows: Sequence[Row]) -> list[tuple[str, Read]]:
        """The clips of some rows; a row group is unpacked once where its rows follow each other."""
        with self._lock:
            read: list[tuple[str, Read]] = []
            for shard, same in groupby(rows, key=lambda row: row["shard"]):
                run = list(same)
                read += self._of_shard(shard, run) if shard else [self._of_file(row) for row in run]
            return read

    def _of_file(self, row: Row) -> tuple[str, Read]:
        path = path_of(self.folder, row["name"])
        try:
            return row["name"], _as_told(path, row, read_clip(path))
        except BadInput as error:
            return row["name"], error

    def _of_shard(self, name: str, rows: list[Row]) -> list[tuple[str, Read]]:
        try:
            shard = self._shard(name)
            groups = [shard.group(row["position"]) for row in rows]
        except BadInput as error:
            return [(row["name"], error) for row in rows]
        read: list[tuple[str, Read]] = []
        for group, pairs in groupby(zip(groups, rows, strict=True), key=lambda pair: pair[0]):
            run = [row for _, row in pairs]
            try:
                if self._last[:2] != (name, group):
                    self._last = (name, group, shard.read(group))
                clips = shard.clips([row["position"] for row in run], self._last[2])
            except BadInput as error:
                clips = dict.fromkeys([row["position"] for row in run], error)
            read += [(row["name"], _as_told(shard.path, row, clips[row["position"]])) for row in run]
        return read

    def _shard(self, name: str) -> Shard:
        if name in self._open:
            self._open.move_to_end(name)
        else:
            self._open[name] = Shard(path_of(self.folder, name))
            if len(self._open) > _OPEN:
                self._open.popitem(last=False)[1].close()
        return self._open[name]


def read_library(folder: Path, names: Sequence[str] | None = None) -> list[Clip]:
    """All clips of a library in the index's order, or those that are named, in that order."""
    library = Library(folder)
    return list(library) if names is None else library.select(names)


def _as_told(path: Path, row: Row, clip: Read) -> Read:
    if isinstance(clip, BadInput):
        return clip
    for fact in _TOLD_TWICE:
        if getattr(clip, fact) != row[fact]:
            came = f"{getattr(clip, fact)!r}"[:80]
            return BadInput(f"{path}: {fact}", f"{row[fact]!r} as in the index"[:80], came, "Write the library again.")
    return clip
