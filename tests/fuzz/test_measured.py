"""Readers of measured logs against bytes and values that nobody meant: a result or one line of `BadInput`, no more.

Every failure names its round, and the round alone makes the same input again: `BUMBLEBEE_FUZZ_SECONDS=600` for long.
"""

import io
import json
import shutil
import warnings
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from bumblebee.errors import BadInput
from bumblebee.io.limits import Limits
from bumblebee.measured.importers.asap_npz import import_asap
from bumblebee.measured.importers.column_map import ColumnMap
from bumblebee.measured.importers.csv_map import import_csv
from bumblebee.measured.importers.map_file import read_map
from bumblebee.measured.importers.so101 import import_so101
from bumblebee.measured.importers.sysid_npz import import_sysid
from bumblebee.measured.intake import UNFORESEEN, intake
from bumblebee.measured.metadata import METADATA_KEY
from bumblebee.measured.rollout import read_rollout, write_rollout
from tests.fuzz.budget import rounds
from tests.measured.simulated import arm_model, arm_rollout, g1_model, g1_rollout

SMALL = Limits(file_bytes=1 << 22, unpacked_bytes=1 << 22, rows=5000)
VALUES = (np.nan, np.inf, -np.inf, 0.0, -0.0, 1e200, -1e300, 1e8, 1e5, 5e-324, -1.0, 1e-9, 2**63, 57.3)
WORDS = (
    "",
    "nan",
    "inf",
    "1e400",
    "1+2j",
    "[1,",
    "[[",
    "\0",
    "\ud800",
    "../../x",
    "=1",
    "true",
    "null",
    "-",
    "9" * 400,
    "é",
)
SHAPES = ((0,), (1,), (2, 0), (60,), (60, 1), (60, 3), (3, 60), (60, 1, 3), (59, 3), (1, 1, 1, 1), ())
KINDS = ("<f8", "<f4", "<i8", "?", "<c16", "<U3", "S2", "<M8[s]", "<f2", "<u8")


@cache
def good_files() -> dict[str, bytes]:
    """One good file of every layout."""
    rollout = replace(arm_rollout(0, seconds=1.2), rollout_id="log")
    q, v, u, t = rollout.joint_pos, rollout.joint_vel, rollout.joint_target, rollout.time
    rest = {"kp": np.full(3, 40.0), "IMU_quaternion": np.ones((60, 4)) / 2, "IMU_gyro": q}
    states = {"state_times": t, "state_data": np.hstack([q, v]), "state_signal_mapping": np.array(MAPPING)}
    rows = "".join(
        ",".join(map(str, [a, *b, *c, k % 3])) + "\n" for k, (a, b, c) in enumerate(zip(t, q, u, strict=True))
    )
    lists = [json.dumps(row.tolist()) for row in q]
    state = "".join(f'X,{k * 2e4},"{a}","{a}"\n' for k, a in enumerate(lists))
    return {
        "log.csv": f"time,q1,q2,q3,u1,u2,u3,run\n{rows}".encode(),
        "map.yaml": b"joints: [shoulder, elbow, wrist]\nepisode: run\nscale: {joint_pos: [1, 2, 3]}\n"
        b"transmission: {wrist: {wrist: 1, elbow: -1}}\nmeta: {robot: r}\n"
        b"columns: {joint_pos: [q1, q2, q3], joint_target: [u1, u2, u3]}\n",
        "state_motor.csv": f"type,timestamp,positions,velocities\n{state}".encode(),
        "joint_list.txt": b"shoulder\nelbow\nwrist\n",
        "asap.npz": npz(time=t, joint_pos=q, joint_vel=v, joint_pos_cmd=u, **rest),
        "sysid.npz": npz(control_times=t, control_data=u, **states),
    }  # fmt: skip


MAPPING = json.dumps(
    {f"{joint}_{kind}": [number, [column + place]]
     for kind, number, column in (("qpos", 2, 0), ("qvel", 3, 3))
     for place, joint in enumerate(("shoulder", "elbow", "wrist"))}
)  # fmt: skip
COLUMNS = ColumnMap(
    ("shoulder", "elbow", "wrist"),
    {"joint_pos": ("q1", "q2", "q3"), "joint_target": ("u1", "u2", "u3")},
    episode="run",
)


def npz(**arrays: np.ndarray) -> bytes:
    stream = io.BytesIO()
    np.savez(stream, **arrays)
    return stream.getvalue()


def mutated(rng: np.random.Generator, data: bytes) -> bytes:
    """Bytes with some turned, cut, doubled or replaced by words that parsers stumble over."""
    out = bytearray(data)
    for _ in range(rng.integers(1, 6)):
        at = int(rng.integers(0, len(out) + 1))
        size = int(rng.integers(0, 20))
        word = WORDS[rng.integers(len(WORDS))].encode("utf-8", "surrogatepass")
        out[at : at + size] = (rng.bytes(size), word, b"", bytes(out[at : at + size]) * 3)[rng.integers(4)]
    return bytes(out[: int(rng.integers(0, len(out) + 1))]) if rng.random() < 0.1 else bytes(out)


def odd_array(rng: np.random.Generator, values: np.ndarray) -> np.ndarray:
    """An array with odd values, of another kind, or of another shape."""
    choice = rng.integers(4)
    if choice == 0 and values.size and values.dtype.kind == "f":
        values = values.copy()
        values.flat[rng.integers(0, values.size, 3)] = rng.choice(VALUES, 3)
        return values
    if choice == 1:
        return np.resize(values, SHAPES[rng.integers(len(SHAPES))])
    if choice == 2:
        with np.errstate(all="ignore"):
            return np.resize(np.arange(9.0), values.shape).astype(KINDS[rng.integers(len(KINDS))])
    return values


def check(number: int, place: Path, read: Callable[[], object]) -> None:
    """Reading gives something or one line, warns of nothing, and writes nothing."""
    before = sorted(place.rglob("*"))
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            read()
    except BadInput as error:
        assert "\n" not in str(error) and len(str(error)) < 4000, f"round {number}: {str(error)[:500]!r}"
    except Exception as error:
        raise AssertionError(f"round {number}: {type(error).__name__}: {error}") from error
    assert sorted(place.rglob("*")) == before, f"round {number}: files appeared"


def readers(folder: Path) -> dict[str, Callable[[], object]]:
    return {
        "log.csv": lambda: import_csv(folder / "log.csv", [COLUMNS]),
        "map.yaml": lambda: import_csv(folder / "log.csv", [read_map(folder / "map.yaml")]),
        "state_motor.csv": lambda: import_so101(folder),
        "joint_list.txt": lambda: import_so101(folder),
        "asap.npz": lambda: import_asap(folder / "asap.npz", arm_model()),
        "sysid.npz": lambda: import_sysid(folder / "sysid.npz", arm_model()),
    }


@pytest.mark.parametrize("name", list(good_files()))
def test_turned_bytes_of_any_layout_are_read_or_one_line(tmp_path: Path, name: str) -> None:
    for other, data in good_files().items():
        (tmp_path / other).write_bytes(data)
    (tmp_path / "control.csv").write_bytes(good_files()["state_motor.csv"])
    readers(tmp_path)[name]()  # as it is it can be read
    for number in rounds(0.08):
        (tmp_path / name).write_bytes(mutated(np.random.default_rng(number), good_files()[name]))
        check(number, tmp_path, readers(tmp_path)[name])


@pytest.mark.parametrize("name", ["asap.npz", "sysid.npz"])
def test_odd_arrays_are_read_or_one_line(tmp_path: Path, name: str) -> None:
    arrays = dict(np.load(io.BytesIO(good_files()[name])))
    for number in rounds(0.08):
        rng = np.random.default_rng(number)
        (tmp_path / name).write_bytes(npz(**{key: odd_array(rng, value) for key, value in arrays.items()}))
        check(number, tmp_path, readers(tmp_path)[name])


def odd_rollout(rng: np.random.Generator, path: Path) -> None:
    """A rollout file with odd values, odd metadata, odd columns or turned bytes."""
    rollout = arm_rollout(0, seconds=1.2) if rng.random() < 0.7 else g1_rollout(0, 0.1, seconds=1.2)
    columns = {}
    for column in ("time", *rollout.columns):
        values = getattr(rollout, column).copy()
        if rng.random() < 0.3:
            flat = values.reshape(-1)
            flat[rng.integers(0, flat.size, rng.integers(1, 5))] = rng.choice(VALUES)
        columns[column] = values * (rng.choice(VALUES) if rng.random() < 0.05 else 1.0)
    path.unlink(missing_ok=True)
    write_rollout(path, replace(rollout, rollout_id=path.stem, **columns))
    table = pq.read_table(path)
    if rng.random() < 0.3:
        said = json.loads(table.schema.metadata[METADATA_KEY])
        values = [*WORDS, None, True, [], {}, -1, 10**400, [[1]], ["a"] * 3, [1.0] * 3, {"a": ["b"]}]
        said[str(rng.choice(sorted(said)))] = values[rng.integers(len(values))]
        table = table.replace_schema_metadata({METADATA_KEY: json.dumps(said).encode()})
    if rng.random() < 0.2:
        at = int(rng.integers(table.num_columns))
        odd = (pa.array(["x"] * table.num_rows), pa.nulls(table.num_rows), pa.array([[1.0]] * table.num_rows),
               pa.array(np.arange(table.num_rows)))  # fmt: skip
        table = table.set_column(at, str(rng.choice(table.column_names)), odd[rng.integers(len(odd))])
    pq.write_table(table, path)
    if rng.random() < 0.2:
        path.write_bytes(mutated(rng, path.read_bytes()))


def test_odd_rollouts_are_read_or_one_line_and_the_intake_sorts_them_all(tmp_path: Path) -> None:
    place = tmp_path / "in" / "rollouts" / "odd.parquet"
    with np.errstate(all="ignore"):
        for number in rounds(0.3):
            rng = np.random.default_rng(number)
            odd_rollout(rng, place)
            check(number, tmp_path, lambda: read_rollout(place, SMALL))
            model = arm_model() if rng.random() < 0.6 else g1_model()
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                batch = intake(tmp_path / "in", tmp_path / "good", tmp_path / "aside", model)
            assert len(batch.items) == 1, f"round {number}"
            broken = batch.findings[batch.findings.rule == UNFORESEEN]
            assert broken.empty, f"round {number}: {broken.message.tolist()}"
            for folder in ("good", "aside"):
                shutil.rmtree(tmp_path / folder, ignore_errors=True)
