"""Bad motion files and libraries by hand: what each is called, and what writes it."""

import lzma
import os
import pickle as python_pickle
import struct
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import joblib
import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from tests.fuzz.motion_files import JOINTS, change_facts, csv, fields, shard, table

Make = Callable[[Path], object]


class Calls:
    """Call that a hostile pickle asks for."""

    def __reduce__(self) -> tuple[Any, ...]:
        return os.system, ("touch executed",)


def text(content: str) -> Make:
    return lambda folder: (folder / "bad.csv").write_text(content)


def raw(content: bytes, name: str = "bad.csv") -> Make:
    return lambda folder: (folder / name).write_bytes(content)


def cells(change: Callable[[np.ndarray], object], frames: int = 24) -> Make:
    def make(folder: Path) -> None:
        values = table(frames)
        changed = change(values)
        (folder / "bad.csv").write_text(csv(values if changed is None else np.asarray(changed)))

    return make


def cell(row: int, column: int, content: str) -> Make:
    lines = [line.split(",") for line in csv(table()).splitlines()]
    lines[row][column] = content
    return text("\n".join(",".join(line) for line in lines) + "\n")


def put(row: Any, column: Any, value: float) -> Make:
    return cells(lambda values: values.__setitem__((row, column), value))


def asap(**changed: Any) -> Make:
    return lambda folder: joblib.dump({"sway": fields(**changed)}, folder / "bad.pkl")


def array(field: str, change: Callable[[np.ndarray], Any]) -> Make:
    return asap(**{field: change(fields()[field])})


def dumped(content: Any) -> Make:
    return lambda folder: joblib.dump(content, folder / "bad.pkl")


def header(names: list[str]) -> Make:
    return text(",".join([*"xyzabcd", *names]) + "\n" + csv(table()))


def with_nan(values: np.ndarray) -> np.ndarray:
    values = values.copy()
    values[3, 1] = np.nan
    return values


def captions(content: bytes) -> Make:
    def make(folder: Path) -> None:
        (folder / "bad.csv").write_text(csv(table()))
        (folder / "bad.txt").write_bytes(content)

    return make


def archive(name: str) -> Make:
    def make(folder: Path) -> None:
        with zipfile.ZipFile(folder / "bad.zip", "w") as out:
            out.writestr(name, "")

    return make


def odd_name(folder: Path) -> None:
    name = os.fsencode(folder / "bad.csv").replace(b"bad.csv", b"bad\n\xff.csv")
    with open(name, "wb") as stream:
        stream.write(b"\0")


# A tuple of tuples 60 deep, two ways down at each level, as the key of a dict: to hash it takes 2^60 steps.
EXPONENTIAL_KEY = b"\x80\x04}N" + b"2\x86" * 60 + b"Ns."
EXPONENTIAL_SHAPE = b"\x80\x04cnumpy\ndtype\n(N" + b"2\x86" * 60 + b"\x85R}\x8c\x01as."
SELF_DESCRIBED = b"\x80\x04cnumpy\ndtype\nN" + b"2\x86" * 60 + b"\x85RN\x8c\x01<\x86b."

FILES: dict[str, Make] = {
    "csv: empty": text(""),
    "csv: blank lines": text("\n\n\n"),
    "csv: bytes": raw(bytes(range(256)) * 8),
    "csv: utf-16": raw(csv(table()).encode("utf-16")),
    "csv: NUL in a cell": cell(4, 5, "\0"),
    "csv: words": text("hello\nworld\n"),
    "csv: a header alone": text(",".join([*"xyzabcd", *JOINTS]) + "\n"),
    "csv: a row too short": text(csv(table()) + "1,2,3\n"),
    "csv: a blank line in the middle": text(csv(table()).replace("\n", "\n\n", 3)),
    "csv: a column too few": cells(lambda values: values[:, :-1]),
    "csv: a column too many": cells(lambda values: np.pad(values, ((0, 0), (0, 1)))),
    "csv: semicolons": text(csv(table()).replace(",", ";")),
    "csv: decimal commas": text(csv(table()).replace(".", ",")),
    "csv: nan": cell(4, 5, "nan"),
    "csv: inf": cell(4, 9, "inf"),
    "csv: 1e400": cell(4, 0, "1e400"),
    "csv: 1e200 in x": cell(4, 0, "1e200"),
    "csv: 1e200 in a joint": cell(4, 12, "1e200"),
    "csv: -1e30 in y at the end": cell(23, 1, "-1e30"),
    "csv: a complex number": cell(4, 5, "1+2j"),
    "csv: 1_0": cell(4, 8, "0_0"),
    "csv: a cell of a megabyte": cell(4, 8, "9" * 1_000_000),
    "csv: three million commas": text("," * 3_000_000 + "\n"),
    "csv: a kilometre jump": put(9, 0, 5000.0),
    "csv: degrees": cells(lambda values: values.__setitem__((slice(None), slice(7, None)), np.degrees(values[:, 7:]))),
    "csv: centimetres": cells(lambda values: values.__setitem__((slice(None), slice(3)), values[:, :3] * 100)),
    "csv: quaternion of zeros": put(slice(None), slice(3, 7), 0.0),
    "csv: quaternion too long": put(5, slice(3, 7), 0.9),
    "csv: three frames": cells(lambda values: values[:3]),
    "csv: an unknown joint": header(["left_tail_joint", *JOINTS[1:]]),
    "csv: a joint twice": header([JOINTS[1], *JOINTS[1:]]),
    "csv: a link in a circle": lambda folder: (folder / "bad.csv").symlink_to("bad.csv"),
    "csv: a link to nothing": lambda folder: (folder / "bad.csv").symlink_to("nothing"),
    "csv: a link to /dev/zero": lambda folder: (folder / "bad.csv").symlink_to("/dev/zero"),
    "csv: a pipe": lambda folder: os.mkfifo(folder / "bad.csv"),
    "csv: a name that is no text": odd_name,
    "folder: a link to itself": lambda folder: (folder / "bad").symlink_to("."),
    "pickle: empty": raw(b"", "bad.pkl"),
    "pickle: cut off": raw(python_pickle.dumps(fields())[:300], "bad.pkl"),
    "pickle: text": raw(b"hello", "bad.pkl"),
    "pickle: runs a command": dumped({"sway": Calls()}),
    "pickle: an exponential key": raw(EXPONENTIAL_KEY, "bad.pkl"),
    "pickle: an exponential key of numpy's": raw(EXPONENTIAL_SHAPE, "bad.pkl"),
    "pickle: an exponential dtype": raw(SELF_DESCRIBED, "bad.pkl"),
    "pickle: a set": raw(python_pickle.dumps({"sway": {1, 2}}), "bad.pkl"),
    "pickle: 3 million dicts": raw(b"\x80\x04" + b"}" * 3_000_000 + b".", "bad.pkl"),
    "pickle: 5,000 levels": raw(b"\x80\x04" + b"}\x8c\x01a" * 5000 + b"}" + b"s" * 5000 + b".", "bad.pkl"),
    "pickle: an endless number": raw(python_pickle.dumps({"sway": {**fields(), "fps": 10**3000}}), "bad.pkl"),
    "pickle: a list": dumped([1, 2]),
    "pickle: no motion": dumped({"sway": 3}),
    "pickle: no rotation": dumped({"sway": {k: v for k, v in fields().items() if k != "root_rot"}}),
    "pickle: NaN in the joints": array("dof", with_nan),
    "pickle: NaN in the root": array("root_trans_offset", with_nan),
    "pickle: 1e200 m": array("root_trans_offset", lambda v: v + 1e200 * np.eye(1, len(v), 3).T * [1, 0, 0]),
    "pickle: complex numbers": array("dof", lambda values: values.astype(complex)),
    "pickle: text for numbers": array("dof", lambda values: values.astype(str)),
    "pickle: objects": array("dof", lambda values: values.astype(object)),
    "pickle: three dimensions": array("dof", lambda values: values[None]),
    "pickle: a joint too few": array("dof", lambda values: values[:, 1:]),
    "pickle: unequal lengths": array("dof", lambda values: values[:-1]),
    "pickle: no frames": asap(dof=np.zeros((0, 23)), root_trans_offset=np.zeros((0, 3)), root_rot=np.zeros((0, 4))),
    "pickle: fps nan": asap(fps=float("nan")),
    "pickle: fps infinite": asap(fps=float("inf")),
    "pickle: fps text": asap(fps="30"),
    "pickle: fps None": asap(fps=None),
    "pickle: an hour and a half at 1 Hz": asap(frames=5400, fps=1),
    "pickle: xz that asks for 1.5 GB": raw(
        lzma.compress(
            python_pickle.dumps({"sway": fields()}),
            lzma.FORMAT_ALONE,
            filters=[{"id": lzma.FILTER_LZMA1, "dict_size": 1 << 20}],
        ).replace(struct.pack("<I", 1 << 20), struct.pack("<I", 3 << 29), 1),
        "bad.pkl",
    ),
    "zip: damaged": raw(b"PK\x05\x06" + b"\xff" * 18, "bad.zip"),
    "zip: an ending of many lines": archive("a.b\nc\nd"),
    "npz": raw(b"x", "bad.npz"),
    "parquet: not ours": raw(b"PAR1", "bad.parquet"),
}


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


CAPTIONS: dict[str, Make] = {
    "captions: bytes": captions(b"\xff\xfe\x00#"),
    "captions: no tokens": captions(b"a person walks\n"),
    "captions: endless": captions(b"a person walks#a/DET#0.0#inf\n"),
    "captions: before the start": captions(b"a person walks#a/DET#-1e300#2\n"),
    "captions: control characters": captions(b"a \x1b[31mperson#a/DET#0#0\n"),
    "captions: 5 MB": captions(b"a person walks#a/DET#0#0\n" * 200_000),
}
"""Text files that cost their motion its captions, and nothing else."""

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
