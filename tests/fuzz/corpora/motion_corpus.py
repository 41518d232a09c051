"""Bad motion files and captions by hand: what each is called, and what writes it."""

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

from tests.fuzz.motion_files import JOINTS, csv, fields, table

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


CAPTIONS: dict[str, Make] = {
    "captions: bytes": captions(b"\xff\xfe\x00#"),
    "captions: no tokens": captions(b"a person walks\n"),
    "captions: endless": captions(b"a person walks#a/DET#0.0#inf\n"),
    "captions: before the start": captions(b"a person walks#a/DET#-1e300#2\n"),
    "captions: control characters": captions(b"a \x1b[31mperson#a/DET#0#0\n"),
    "captions: 5 MB": captions(b"a person walks#a/DET#0#0\n" * 200_000),
}
"""Text files that cost their motion its captions, and nothing else."""
