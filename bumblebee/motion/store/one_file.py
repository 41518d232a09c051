"""One Parquet file a clip, `clips/<name>.parquet`: how libraries were laid out before shards. They are still read."""

import json
import os
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from bumblebee.errors import BadInput
from bumblebee.motion.checks import MAX_FRAMES, check_clip
from bumblebee.motion.clip import Clip
from bumblebee.motion.clip_facts import facts_of, read_facts
from bumblebee.motion.parquet import Kind, read_table
from bumblebee.motion.store.columns import arrays_of, columns, table_of

_META = b"bumblebee.clip"


def write_clip(path: Path, clip: Clip) -> None:
    """Write one clip as Parquet."""
    schema = pa.schema(
        [(name, pa.float32()) for name in columns()], metadata={_META: json.dumps(facts_of(clip)).encode()}
    )
    arrays = [pa.array(column) for column in np.ascontiguousarray(table_of(clip).T)]
    pq.write_table(pa.Table.from_arrays(arrays, schema=schema), path, compression="zstd")


def read_clip(path: Path) -> Clip:
    """Read one clip that `write_clip` wrote; whatever else is found there is a `BadInput`."""
    path = Path(path)
    if not os.path.lexists(path):
        raise BadInput(path, "a clip of a motion library", "no such file")
    kinds: dict[str, Kind] = dict.fromkeys(columns(), "number")
    table = read_table(path, kinds, MAX_FRAMES)
    metadata = table.schema.metadata or {}
    if _META not in metadata:
        raise BadInput(path, "the metadata of a bumblebee clip", "none")
    facts = read_facts(path, metadata[_META])
    if facts["name"] != path.stem:
        raise BadInput(f"{path}: name", f"{path.stem!r}, as the file is called", repr(facts["name"])[:80])
    with np.errstate(over="ignore"):  # what float32 cannot hold becomes infinite and is refused below
        values = np.stack([column.to_numpy() for column in table.columns], axis=1).astype(np.float32)
    clip = Clip(**facts, **arrays_of(values))
    check_clip(path, clip)
    return clip
