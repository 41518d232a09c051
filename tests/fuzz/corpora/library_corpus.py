"""Bad motion libraries by hand: what each is called, and what makes it of a good one."""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from tests.fuzz.corpora.motion_corpus import Make
from tests.fuzz.motion_files import change_facts, shard


def column(name: str, change: Callable[[np.ndarray], Any]) -> Make:
    """One column of the clip `sway` changed."""

    def make(folder: Path) -> None:
        path = shard(folder)
        found = pq.read_table(path)
        values = pa.array(change(found.column(name).to_numpy().copy()))
        index = found.column_names.index(name)
        pq.write_table(found.set_column(index, name, values).replace_schema_metadata(found.schema.metadata), path)

    return make


def facts(**changed: Any) -> Make:
    return lambda folder: change_facts(shard(folder), lambda found: found.update(changed))


def without(key: str) -> Make:
    return lambda folder: change_facts(shard(folder), lambda found: found.__delitem__(key))


def metadata(content: str) -> Make:
    return lambda folder: change_facts(shard(folder), lambda _: content)


def index(change: Callable[[pd.DataFrame], Any]) -> Make:
    def make(folder: Path) -> None:
        found = pd.read_parquet(folder / "index.parquet")
        changed = change(found)
        (found if changed is None else changed).to_parquet(folder / "index.parquet", index=False)

    return make


def swapped_joints(folder: Path) -> None:
    path = shard(folder)
    found = pq.read_table(path)
    names = found.column_names
    one, other = (names.index(f"{side}_knee_joint") for side in ("left", "right"))
    left, right = found.column(one), pa.chunked_array([found.column(other).to_numpy() + np.float32(0.3)])
    found = found.set_column(one, names[one], right).set_column(other, names[other], left)
    pq.write_table(found, path)


def cut(file: Callable[[Path], Path], share: float) -> Make:
    def make(folder: Path) -> None:
        data = file(folder).read_bytes()
        file(folder).write_bytes(data[: int(len(data) * share)])

    return make


def table_file(folder: Path) -> Path:
    return folder / "index.parquet"


def long_text(folder: Path) -> None:
    """One licence of a megabyte, named by 50,000 rows: a small file that unpacks to 50 GB."""
    found = pq.read_table(folder / "index.parquet").slice(0, 1)
    many = pa.concat_tables([found] * 1).take(pa.array(np.zeros(50_000, dtype=np.int64)))
    place = many.column_names.index("licence")
    word = pa.DictionaryArray.from_arrays(pa.array(np.zeros(50_000, dtype=np.int32)), pa.array(["x" * 1_000_000]))
    names = pa.array([f"n{i}" for i in range(50_000)])
    pq.write_table(many.set_column(place, "licence", word).set_column(0, "name", names), folder / "index.parquet")


def many_rows(folder: Path) -> None:
    """A column of equal numbers packs a thousandfold and more."""
    found = pq.read_table(shard(folder))
    same = pa.array(np.zeros(4_100_000, dtype=np.float32))
    one = pa.table({found.column_names[0]: same}, metadata=found.schema.metadata)
    pq.write_table(one, shard(folder))


def replaced(file: Callable[[Path], Path], make: Make) -> Make:
    def change(folder: Path) -> None:
        path = file(folder)
        path.unlink()
        make(path)

    return change


def renamed(name: str) -> Make:
    """Index and clip agree on a name that leads out of the library."""

    def make(folder: Path) -> None:
        facts(name=name)(folder)
        index(lambda found: found.__setitem__("name", name))(folder)

    return make


def shard_elsewhere(folder: Path) -> None:
    """The shard lies out of the library, under a name that the index gives."""
    shard(folder).rename(folder / "escaped.parquet")
    index(lambda found: found.__setitem__("shard", "../escaped"))(folder)


LIBRARIES: dict[str, Make] = {
    "name: out of the library": renamed("../../escaped"),
    "name: a folder": renamed("a/b"),
    "name: hidden": renamed(".hidden"),
    "name: another than the file's": facts(name="other"),
    "name: a number": facts(name=3),
    "clip: NaN": column("root_x", lambda v: np.where(np.arange(len(v)) == 3, np.nan, v).astype(np.float32)),
    "clip: infinity": column("left_knee_joint", lambda v: np.where(np.arange(len(v)) == 3, np.inf, v)),
    "clip: 1e30 m": column("root_x", lambda v: (v + 1e30).astype(np.float32)),
    "clip: 1e200 m": column("root_x", lambda v: v.astype(float) + 1e200),
    "clip: degrees": column("left_knee_joint", lambda v: v * 57.3),
    "clip: no unit quaternions": column("root_qw", lambda v: v * 2),
    "clip: keypoints of another pose": column("left_knee_joint", lambda v: v + np.float32(0.5)),
    "clip: two joints swapped": swapped_joints,
    "clip: text": column("root_x", lambda v: [str(x) for x in v]),
    "clip: whole numbers": column("root_x", lambda v: v.astype(int)),
    "clip: a gap": column("root_x", lambda v: [None, *v[1:].tolist()]),
    "clip: no rows": lambda f: pq.write_table(pq.read_table(shard(f)).slice(0, 0), shard(f)),
    "clip: a column missing": lambda f: pq.write_table(pq.read_table(shard(f)).drop_columns(["root_x"]), shard(f)),
    "clip: 4 million rows": many_rows,
    "clip: cut off": cut(shard, 0.6),
    "clip: empty": cut(shard, 0),
    "clip: gone": lambda folder: shard(folder).unlink(),
    "clip: a folder": replaced(shard, lambda path: path.mkdir()),
    "clip: a pipe": replaced(shard, os.mkfifo),
    "facts: none": lambda f: pq.write_table(pq.read_table(shard(f)).replace_schema_metadata(None), shard(f)),
    "facts: no JSON": metadata("{"),
    "facts: a list": metadata("[1]"),
    "facts: null": metadata("null"),
    "facts: 5,000 deep": metadata("[" * 5000 + "]" * 5000),
    "facts: without captions": without("captions"),
    "facts: without fps": without("fps"),
    "facts: an unknown key": facts(colour="red"),
    "facts: a field of the arrays": facts(root_pos=[1]),
    "facts: captions a number": facts(captions=3),
    "facts: captions of numbers": facts(captions=[1, 2]),
    "facts: captions null": facts(captions=None),
    "facts: a caption in another form": facts(captions=["a person walks"]),
    "facts: a caption of many lines": facts(captions=["a\nb#c#0#0"]),
    "facts: fps text": facts(fps="50"),
    "facts: fps 0": facts(fps=0),
    "facts: fps true": facts(fps=True),
    "facts: fps negative": facts(fps=-50.0),
    "facts: fps NaN": facts(fps=float("nan")),
    "facts: fps 1e300": facts(fps=1e300),
    "facts: split unknown": facts(split="validation"),
    "facts: licence a list": facts(licence=["MIT"]),
    "facts: source of 10 MB": facts(source="x" * 10_000_000),
    "index: gone": lambda folder: (folder / "index.parquet").unlink(),
    "index: cut off": cut(table_file, 0.7),
    "index: no Parquet": lambda folder: (folder / "index.parquet").write_bytes(b"PAR1 no PAR1"),
    "index: a pipe": replaced(table_file, os.mkfifo),
    "index: no names": index(lambda found: found.drop(columns="name")),
    "index: names are numbers": index(lambda found: found.__setitem__("name", 3)),
    "index: a name missing": index(lambda found: found.__setitem__("name", None)),
    "index: a name twice": index(lambda found: pd.concat([found, found])),
    "index: names alike but for case": index(lambda f: pd.concat([f, f.assign(name="SWAY")])),
    "index: a clip that is not there": index(lambda found: found.__setitem__("name", "jump")),
    "index: another number of frames": index(lambda found: found.__setitem__("frames", 99)),
    "index: a shard out of the library": shard_elsewhere,
    "index: a shard that is not there": index(lambda found: found.__setitem__("shard", "0" * 32)),
    "index: a shard's name of another form": index(lambda found: found.__setitem__("shard", "sway")),
    "index: shards are numbers": index(lambda found: found.__setitem__("shard", 3)),
    "index: a position beyond the shard": index(lambda found: found.__setitem__("position", 1)),
    "index: a position before it": index(lambda found: found.__setitem__("position", -1)),
    "facts: more frames than rows": facts(frames=25),
    "facts: fewer frames than rows": facts(frames=23),
    "facts: frames negative": facts(frames=-24),
    "facts: frames text": facts(frames="24"),
    "index: another split": index(lambda found: found.__setitem__("split", "test")),
    "index: frames are text": index(lambda found: found.__setitem__("frames", "many")),
    "index: 50 GB of one text": long_text,
}
