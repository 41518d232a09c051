"""A library of clips on disk: a folder of Parquet files with an index.

- `index.parquet`: one row a clip
- `clips/<name>.parquet`: the arrays, with the facts about the clip in the schema's metadata
- `skipped.csv`: source files that are not in the library, and why
"""

import json
import os
import shutil
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from bumblebee.errors import BadInput
from bumblebee.io.names import require_stem
from bumblebee.motion.checks import MAX_FRAMES, check_clip
from bumblebee.motion.clip import Clip
from bumblebee.motion.clip_facts import FACTS, read_facts
from bumblebee.motion.parquet import Kind, read_table
from bumblebee.robot.facts import KEY_BODIES, joint_names

_INDEX: dict[str, Kind] = {
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
INDEX_COLUMNS = tuple(_INDEX)
_TOLD_TWICE = ("family", "split", "source", "licence", "sha256", "frames", "caption_source")  # by index and clip
_MAX_CLIPS = 100_000
_META = b"bumblebee.clip"


def write_library(folder: Path, clips: Iterable[Clip], skipped: pd.DataFrame | None = None) -> None:
    """Write a library, replacing what `folder` held; on any failure the folder stays as it was.

    Args:
        folder: where the library goes.
        clips: with distinct names.
        skipped: columns `file`, `reason`.
    """
    folder = Path(folder)
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        fresh = Path(tempfile.mkdtemp(prefix=f".{folder.name}.", dir=folder.parent))
    except OSError as error:
        raise _unwritable(folder, error) from error
    try:
        fresh.chmod(0o755)
        _fill(fresh, clips, skipped)
        _swap(fresh, folder)
    except OSError as error:
        raise _unwritable(folder, error) from error
    finally:
        shutil.rmtree(fresh, ignore_errors=True)


def read_library(folder: Path, names: Sequence[str] | None = None) -> list[Clip]:
    """All clips of a library in the index's order, or those that are named, in that order."""
    folder = Path(folder)
    index = read_index(folder)
    rows = {row["name"]: row for row in index.to_dict("records")}
    for name in names or ():
        if name not in rows:
            raise BadInput(folder / "index.parquet", f"a clip named {name!r}", f"{len(rows)} clips without it")
    return [read_indexed(folder, rows[name]) for name in (rows if names is None else names)]


def read_indexed(folder: Path, row: Mapping[str, Any]) -> Clip:
    """The clip of one row of the index, which must say the same about it as its own file."""
    path = folder / "clips" / f"{row['name']}.parquet"
    clip = read_clip(path)
    for fact in _TOLD_TWICE:
        if getattr(clip, fact) != row[fact]:
            came = f"{getattr(clip, fact)!r}"[:80]
            raise BadInput(f"{path}: {fact}", f"{row[fact]!r} as in the index"[:80], came, "Write the library again.")
    return clip


def read_index(folder: Path) -> pd.DataFrame:
    """The library's table, one row a clip, columns `INDEX_COLUMNS`; each name can name a file, and names one clip."""
    path = Path(folder) / "index.parquet"
    if not os.path.lexists(path):
        raise BadInput(path, "the index of a motion library", "no such file", "Run the stage that writes it.")
    # Without the file's own notes for pandas, which would be believed and may be damaged.
    index = read_table(path, _INDEX, _MAX_CLIPS).replace_schema_metadata(None).to_pandas()
    taken: dict[str, int] = {}
    for row, name in enumerate(index["name"]):
        require_stem(f"{path}, row {row}: name", name)
        if (first := taken.setdefault(name.casefold(), row)) != row:
            raise BadInput(f"{path}, row {row}: name", f"another name than in row {first}", repr(name)[:80])
    return index


def write_clip(path: Path, clip: Clip) -> None:
    """Write one clip as Parquet."""
    table = np.concatenate(
        [clip.root_pos, clip.root_quat, clip.joint_pos, clip.key_pos.reshape(clip.frames, -1)], axis=1
    )
    facts = {"name": clip.name, "fps": clip.fps, **{fact: getattr(clip, fact) for fact in FACTS}}
    schema = pa.schema([(name, pa.float32()) for name in _columns()], metadata={_META: json.dumps(facts)})
    arrays = [pa.array(column) for column in np.ascontiguousarray(table.T, dtype=np.float32)]
    pq.write_table(pa.Table.from_arrays(arrays, schema=schema), path, compression="zstd")


def read_clip(path: Path) -> Clip:
    """Read one clip that `write_clip` wrote; whatever else is found there is a `BadInput`."""
    path = Path(path)
    if not os.path.lexists(path):
        raise BadInput(path, "a clip of a motion library", "no such file")
    columns: dict[str, Kind] = dict.fromkeys(_columns(), "number")
    table = read_table(path, columns, MAX_FRAMES)
    metadata = table.schema.metadata or {}
    if _META not in metadata:
        raise BadInput(path, "the metadata of a bumblebee clip", "none")
    facts = read_facts(path, metadata[_META])
    if facts["name"] != path.stem:
        raise BadInput(f"{path}: name", f"{path.stem!r}, as the file is called", repr(facts["name"])[:80])
    with np.errstate(over="ignore"):  # what float32 cannot hold becomes infinite and is refused below
        values = np.stack([column.to_numpy() for column in table.columns], axis=1).astype(np.float32)
    root_pos, root_quat, joint_pos, key_pos = np.split(values, [3, 7, 7 + len(joint_names())], axis=1)
    key_pos = key_pos.reshape(-1, len(KEY_BODIES), 3)
    arrays = {"root_pos": root_pos, "root_quat": root_quat, "joint_pos": joint_pos, "key_pos": key_pos}
    facts.update({name: np.ascontiguousarray(values) for name, values in arrays.items()})
    clip = Clip(**facts)
    check_clip(path, clip)
    return clip


def index_of(clips: Iterable[Clip]) -> pd.DataFrame:
    """The index as a table, without writing anything."""
    rows = [{column: getattr(clip, column) for column in INDEX_COLUMNS} for clip in clips]
    frame = pd.DataFrame(rows, columns=list(INDEX_COLUMNS))
    frame["captions"] = [list(captions) for captions in frame["captions"]]
    return frame


def _columns() -> list[str]:
    keys = [f"{body}_{axis}" for body in KEY_BODIES for axis in "xyz"]
    return [*(f"root_{a}" for a in "xyz"), *(f"root_q{a}" for a in "wxyz"), *joint_names(), *keys]


def _fill(folder: Path, clips: Iterable[Clip], skipped: pd.DataFrame | None) -> None:
    (folder / "clips").mkdir()
    rows: list[Clip] = []
    taken: set[str] = set()  # a file system may not tell cases apart
    for clip in clips:
        require_stem(f"{clip.source or 'a clip'}: name", clip.name)
        if clip.name.casefold() in taken:
            raise BadInput(clip.source or clip.name, "distinct clip names", f"two clips named {clip.name!r}")
        taken.add(clip.name.casefold())
        check_clip(f"{clip.source or 'a clip'}: {clip.name}", clip)
        write_clip(folder / "clips" / f"{clip.name}.parquet", clip)
        rows.append(clip)
    index_of(rows).to_parquet(folder / "index.parquet", index=False)
    if skipped is None:
        skipped = pd.DataFrame(columns=["file", "reason"])
    skipped.to_csv(folder / "skipped.csv", index=False)


def _swap(fresh: Path, folder: Path) -> None:
    """Put `fresh` where `folder` is; renames only, so that no reader meets a half-written library."""
    old = folder.with_name(f".{folder.name}.old-{os.getpid()}")
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
