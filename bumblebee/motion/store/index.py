"""The library's table: one row a clip, with the shard that holds it and its position there."""

import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from bumblebee.errors import BadInput
from bumblebee.io.names import require_stem
from bumblebee.io.whole import put
from bumblebee.motion.clip import Clip
from bumblebee.motion.parquet import Kind, read_table
from bumblebee.motion.store.place import names_shard

FILE = "index.parquet"
_FACTS: dict[str, Kind] = {
    "name": "text",
    "family": "text",
    "split": "text",
    "source": "text",
    "licence": "text",
    "sha256": "text",
    "frames": "whole",
    "duration": "number",
    "captions": "texts",
    "caption_source": "text",
}
INDEX_COLUMNS = tuple(_FACTS)
_PLACE: dict[str, Kind] = {"shard": "text", "position": "whole"}
PLACE_COLUMNS = tuple(_PLACE)
_MAX_CLIPS = 2_000_000
_TYPES = {"text": pa.string(), "texts": pa.list_(pa.string()), "whole": pa.int64(), "number": pa.float64()}

Row = dict[str, Any]


def read_index(folder: Path) -> pd.DataFrame:
    """The library's table, one row a clip, columns `INDEX_COLUMNS`; each name can name a file, and names one clip."""
    return read_places(folder)[list(INDEX_COLUMNS)]


def read_places(folder: Path) -> pd.DataFrame:
    """Index with `PLACE_COLUMNS`: name of the shard and position in it; "" and -1 for a clip in its own file."""
    path = Path(folder) / FILE
    if not os.path.lexists(path):
        raise BadInput(path, "the index of a motion library", "no such file", "Run the stage that writes it.")
    # Without the file's own notes for pandas, which would be believed and may be damaged.
    table = read_table(path, _FACTS | _PLACE, _MAX_CLIPS, maybe=PLACE_COLUMNS).replace_schema_metadata(None)
    index = table.to_pandas()
    if "shard" not in index:
        index["shard"] = ""
    if "position" not in index:
        index["position"] = -1
    taken: dict[str, int] = {}
    for row, name in enumerate(index["name"]):
        require_stem(f"{path}, row {row}: name", name)
        if (first := taken.setdefault(name.casefold(), row)) != row:
            raise BadInput(f"{path}, row {row}: name", f"another name than in row {first}", repr(name)[:80])
    for shard in index["shard"].unique():
        if shard and not names_shard(shard):
            raise BadInput(f"{path}: shard", "the 32 digits that name a shard", repr(shard)[:80])
    return index


def write_index(folder: Path, rows: Iterable[Row]) -> None:
    """Write the table, whole or not at all; rows have `INDEX_COLUMNS` and `PLACE_COLUMNS`."""
    kinds = _FACTS | _PLACE
    schema = pa.schema([(name, _TYPES[kind]) for name, kind in kinds.items()])
    rows = list(rows)
    table = pa.table({name: [row[name] for row in rows] for name in kinds}, schema=schema)
    sink = pa.BufferOutputStream()
    pq.write_table(table, sink, compression="zstd")
    put(folder / FILE, sink.getvalue().to_pybytes())


def row_of(clip: Clip) -> Row:
    """Row of the index on a clip, without its place."""
    return {column: getattr(clip, column) for column in INDEX_COLUMNS}


def index_of(clips: Iterable[Clip]) -> pd.DataFrame:
    """The index as a table, without writing anything."""
    frame = pd.DataFrame([row_of(clip) for clip in clips], columns=list(INDEX_COLUMNS))
    frame["captions"] = [list(captions) for captions in frame["captions"]]
    return frame
