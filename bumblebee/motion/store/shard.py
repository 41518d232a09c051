"""A shard: one Parquet file of some hundred clips, a row a frame, with whole clips in row groups that are read alone.

The facts about the clips stand in the file's metadata. Equal clips give equal bytes, and the file is named by their
hash, so that what did not change keeps its name.
"""

import hashlib
import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from bumblebee.errors import BadInput
from bumblebee.io.limits import LIMITS
from bumblebee.io.read import decode, parse_json
from bumblebee.motion.checks import check_clips
from bumblebee.motion.clip import Clip
from bumblebee.motion.clip_facts import facts_of, require_facts
from bumblebee.motion.parquet import Numbers
from bumblebee.motion.store.columns import arrays_of, columns, table_of
from bumblebee.motion.store.index import INDEX_COLUMNS

GROUP_CLIPS = 16  # in a row group: what one read unpacks at least, and what a damaged page costs
GROUP_FRAMES = 50_000  # beyond it a row group ends: a thousand seconds at 50 Hz
LEAST_CLIPS, MOST_CLIPS = 128, 512  # in a shard; between them a clip's name decides where it ends
MOST_FRAMES = 250_000  # beyond it a shard ends: 72 MB unpacked, the memory that writing takes
MOST_FACTS = 4 << 20  # bytes of facts beyond which it ends, far below what a reader takes
_META = b"bumblebee.clips"
_LEVEL = 3  # of zstd
_MAX_ROWS = 8_000_000


def ends(name: str) -> bool:
    """Whether a shard of enough clips ends after the clip of this name, as one in 128 does.

    By the name and not by counting, so that a clip more or less leaves the shards after its own as they were.
    """
    return hashlib.sha256(name.encode()).digest()[0] < 2


def encoded(clips: Sequence[Clip]) -> bytes:
    """The file's bytes."""
    schema = pa.schema([(name, pa.float32()) for name in columns()])
    sink = pa.BufferOutputStream()
    with pq.ParquetWriter(
        sink,
        schema,
        compression="zstd",
        compression_level=_LEVEL,
        use_dictionary=False,
        use_byte_stream_split=True,  # halves what zstd leaves of smooth float32
        write_statistics=False,
        write_page_checksum=True,
        store_schema=False,
    ) as writer:
        for group in grouped(clips):
            values = np.ascontiguousarray(np.concatenate([table_of(clip) for clip in group]).T)
            table = pa.Table.from_arrays([pa.array(column) for column in values], schema=schema)
            writer.write_table(table, row_group_size=len(values[0]))
        facts = [{"frames": clip.frames, **facts_of(clip)} for clip in clips]
        writer.add_key_value_metadata({_META.decode(): json.dumps(facts)})
    return bytes(sink.getvalue())


def name_of(data: bytes) -> str:
    """The shard's name: the beginning of the hash of its bytes."""
    return hashlib.sha256(data).hexdigest()[:32]


def grouped(clips: Sequence[Clip]) -> Iterator[Sequence[Clip]]:
    """The clips of each row group."""
    start = frames = 0
    for place, clip in enumerate(clips):
        if place > start and (place - start == GROUP_CLIPS or frames + clip.frames > GROUP_FRAMES):
            yield clips[start:place]
            start, frames = place, 0
        frames += clip.frames
    if clips:
        yield clips[start:]


class Shard:
    """An opened shard; `facts` has the facts of each clip by position."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._file = Numbers(path, columns(), _MAX_ROWS)
        try:
            self.facts, frames = self._read_facts()
            self._places = self._find_places(frames)
        except BaseException:
            self._file.close()
            raise

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def group(self, position: int) -> int:
        """The row group of the clip at a position.

        Raises:
            BadInput: there is none.
        """
        if not 0 <= position < len(self._places):
            raise BadInput(self.path, f"a clip at position {position}", f"{len(self._places)} clips")
        return self._places[position][0]

    def read(self, group: int) -> np.ndarray:
        """The rows of a row group, for `clips`.

        Raises:
            BadInput: it is damaged.
        """
        return self._file.read(group)

    def clips(self, positions: Sequence[int], values: np.ndarray) -> dict[int, Clip | BadInput]:
        """The clips at some positions of one row group, checked; one with wrong values is what is wrong with it."""
        made = {}
        for position in positions:
            _, start, frames = self._places[position]
            made[position] = Clip(**self.facts[position], **arrays_of(values[start : start + frames]))
        try:
            check_clips([(self.where(position), clip) for position, clip in made.items()])
        except BadInput:
            return {position: self._judged(position, clip) for position, clip in made.items()}
        return dict(made)

    def _judged(self, position: int, clip: Clip) -> Clip | BadInput:
        try:
            check_clips([(self.where(position), clip)])
        except BadInput as error:
            return error
        return clip

    def rows(self) -> list[dict[str, Any]]:
        """Rows of the index on the clips, but for the shard's name."""
        return [
            {
                **{column: facts[column] for column in INDEX_COLUMNS if column in facts},
                "frames": frames,
                "duration": (frames - 1) / facts["fps"],
                "position": position,
            }
            for position, (facts, (_, _, frames)) in enumerate(zip(self.facts, self._places, strict=True))
        ]

    def where(self, position: int) -> str:
        """How a message names a clip."""
        return f"{self.path}: {self.facts[position]['name']}"

    def _read_facts(self) -> tuple[list[dict[str, Any]], list[int]]:
        if _META not in self._file.notes:
            raise BadInput(self.path, "the metadata of a shard of bumblebee clips", "none")
        data = self._file.notes[_META]
        if len(data) > LIMITS.text_bytes:
            raise BadInput(self.path, f"at most {LIMITS.text_bytes:,} bytes of facts", f"{len(data):,}")
        rows = parse_json(self.path, decode(self.path, data))
        if not isinstance(rows, list):
            raise BadInput(self.path, "a list of facts about clips", f"a {type(rows).__name__}")
        facts, lengths = [], []
        for position, row in enumerate(rows):
            where = f"{self.path}, clip {position}"
            frames = row.pop("frames", None) if isinstance(row, dict) else None
            facts.append(require_facts(where, row))
            if isinstance(frames, bool) or not isinstance(frames, int) or frames < 1:
                raise BadInput(f"{where}: frames", "a number of frames", repr(frames)[:60])
            lengths.append(frames)
        return facts, lengths

    def _find_places(self, lengths: list[int]) -> list[tuple[int, int, int]]:
        """(row group, first row in it, frames) of each clip; no clip lies in two row groups."""
        places, clips = [], iter(lengths)
        for group, rows in enumerate(self._file.rows):
            start = 0
            while start < rows:
                frames = next(clips, None)
                if frames is None or start + frames > rows:
                    raise BadInput(self.path, "clips that fill its row groups", f"others in row group {group}")
                places.append((group, start, frames))
                start += frames
        if len(places) != len(lengths):
            raise BadInput(self.path, f"rows for {len(lengths)} clips", f"rows for {len(places)}")
        return places
