"""Damaged motion files, pickles, libraries and policy folders: finite data or one line, and nothing else."""

import json
import os
import pickle
import shutil
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from bumblebee.errors import BadInput
from bumblebee.motion.captions import parse_caption
from bumblebee.motion.checks import check_clip
from bumblebee.motion.clip import Clip
from bumblebee.motion.reading.folder import ReadConfig, read_file
from bumblebee.motion.store import read_library
from bumblebee.policy.exported import ExportedPolicy
from tests.fuzz.budget import SECONDS, rounds
from tests.fuzz.motion_files import change_facts, csv, fields, library, policy, shard, table

CONFIG = ReadConfig(csv_fps=30, joints_23="asap")
SHARE = 1 / 7  # of the file's seconds, for each test
WORDS = ("nan", "inf", "-1e200", "1e400", "0", "", ",", "\n", "1_0", "\0", '"', "-", "९", "1+2j", "#", "true")
START = int.from_bytes(os.urandom(4), "little") if "BUMBLEBEE_FUZZ_SECONDS" in os.environ else 0


SETTINGS = settings(
    max_examples=max(20, int(SECONDS * 8)),
    deadline=None,
    database=None,
    derandomize=START == 0,
    suppress_health_check=list(HealthCheck),
)


def outcome(read: Callable[[], list[Clip]], how: str) -> None:
    """Run a reader: what it returns must be right, what it raises must be one line; `how` says it again."""
    try:
        clips = read()
    except BadInput as error:
        assert str(error).isprintable() and len(str(error)) < 2000, f"{how}: {str(error)[:300]!r}"
        return
    except Exception as error:
        pytest.fail(f"{how}: {type(error).__name__}: {error}")
    for clip in clips:
        check_clip(how, clip)
        assert Path(clip.name).name == clip.name, how


def damaged(data: bytes, seed: int) -> bytes:
    """Bytes flipped, cut out, doubled, inserted or replaced by words that readers know."""
    rng = np.random.default_rng(seed)
    out = bytearray(data)
    for _ in range(int(rng.integers(1, 5))):
        at, length = (int(rng.integers(0, len(out) + 1)) for _ in range(2))
        kind, end = int(rng.integers(6)), at + min(length, 40)
        if kind == 0 and out:
            out[min(at, len(out) - 1)] = int(rng.integers(256))
        elif kind == 1:
            del out[at:end]
        elif kind == 2:
            out[at:at] = out[at:end]
        elif kind == 3:
            out[at:at] = rng.bytes(int(rng.integers(1, 9)))
        elif kind == 4:
            out[at:end] = str(rng.choice(WORDS)).encode()
        else:
            del out[at:]
    return bytes(out)


def each(share: float = SHARE):
    return (START + number for number in rounds(share))


def test_damaged_csv_files(tmp_path: Path) -> None:
    whole, path = csv(table()).encode(), tmp_path / "a.csv"
    for seed in each():
        path.write_bytes(damaged(whole, seed))
        outcome(lambda: read_file(path, CONFIG), f"csv, seed {seed}")


CELLS = st.tuples(st.integers(0, 23), st.integers(0, 29), st.floats().map(str) | st.sampled_from(WORDS))


@SETTINGS
@given(st.lists(CELLS, max_size=5))
def test_csv_files_with_any_cells(
    tmp_path_factory: pytest.TempPathFactory, changes: list[tuple[int, int, str]]
) -> None:
    rows = [line.split(",") for line in csv(table()).splitlines()]
    for row, column, content in changes:
        rows[row][column] = content
    path = tmp_path_factory.mktemp("csv") / "a.csv"
    path.write_text("\n".join(",".join(row) for row in rows))
    outcome(lambda: read_file(path, CONFIG), f"{changes!r}")


def test_damaged_pickles(tmp_path: Path) -> None:
    path = tmp_path / "a.pkl"
    whole = [pickle.dumps({"sway": fields(12)}, protocol) for protocol in range(6)]
    for seed in each():
        data = damaged(whole[seed % 6], seed)
        path.write_bytes(zlib.compress(data) if seed % 3 == 0 else data)
        outcome(lambda: read_file(path, CONFIG), f"pickle, seed {seed}")


OPCODES = [
    bytes([code]) for code in (*b"]})(l.d0120KJMUTXqrhjtaesubRciopgILFGNQ", 0x80, 0x81, 0x82, *range(0x85, 0x99))
]
SNIPPETS = [*OPCODES, b"cnumpy\ndtype\n", b"cnumpy\nndarray\n", b"cjoblib.numpy_pickle\nNumpyArrayWrapper\n", b")\x81",
            b"cnumpy.core.multiarray\n_reconstruct\n", b"\x8c\x02f8", b"K\x05", b"\x8c\x03dof", b"C\x08abcdefgh",
            b"cos\nsystem\n", b"\x94h\x00", b"I1\n", b"(K\x02K\x03t"]  # fmt: skip


@SETTINGS
@given(st.lists(st.sampled_from(SNIPPETS), max_size=40))
def test_pickles_of_any_instructions(tmp_path_factory: pytest.TempPathFactory, program: list[bytes]) -> None:
    path = tmp_path_factory.mktemp("pickle") / "a.pkl"
    path.write_bytes(b"\x80\x04" + b"".join(program) + b".")
    outcome(lambda: read_file(path, CONFIG), f"{program!r}")


def test_damaged_libraries(tmp_path: Path) -> None:
    whole, folder = library(tmp_path / "whole", "a", "b"), tmp_path / "in/lib"
    for seed in each():
        shutil.rmtree(folder, ignore_errors=True)
        shutil.copytree(whole, folder)
        path = folder / "index.parquet" if seed % 2 else shard(folder)
        path.write_bytes(damaged(path.read_bytes(), seed))
        outcome(lambda: read_library(folder), f"library, seed {seed}")
        assert sorted(p.name for p in tmp_path.rglob("*") if p.is_dir()) == ["clips", "clips", "in", "lib", "whole"]


def odd(rng: np.random.Generator) -> object:
    """Something that stands where it should not."""
    things = (None, True, -1, 0, 3, 1e308, "", "x" * 9000, "a\nb", "../x", "/etc/x", [], [[]], {}, ["a#b#0#0"], [None])
    return things[rng.integers(len(things))]


def test_libraries_with_odd_facts_and_values(tmp_path: Path) -> None:
    folder = library(tmp_path / "lib")
    path = shard(folder)
    whole, index = path.read_bytes(), (folder / "index.parquet").read_bytes()
    for seed in each():
        rng = np.random.default_rng(seed)
        path.write_bytes(whole)
        (folder / "index.parquet").write_bytes(index)
        if seed % 3 == 0:
            change_facts(path, lambda found, rng=rng: found.update({str(rng.choice(list(found))): odd(rng)}))
        elif seed % 3 == 1:
            found = pq.read_table(path)
            at = int(rng.integers(found.num_columns))
            values = found.column(at).to_numpy().copy()
            values[rng.integers(len(values))] = rng.choice([np.nan, np.inf, -np.inf, 1e30, -1e4, 50, 0, 1e-40])
            pq.write_table(found.set_column(at, found.column_names[at], pa.array(values)), path)
        else:
            found = pq.read_table(folder / "index.parquet")
            at, thing = int(rng.integers(found.num_columns)), odd(rng)
            kept = pa.array([thing] * len(found)) if not isinstance(thing, dict) else pa.nulls(len(found))
            pq.write_table(found.set_column(at, found.column_names[at], kept), folder / "index.parquet")
        outcome(lambda: read_library(folder), f"facts, seed {seed}")


def test_damaged_policy_folders(tmp_path: Path) -> None:
    whole, folder = policy(tmp_path / "whole"), tmp_path / "policy"
    for seed in each():
        rng = np.random.default_rng(seed)
        shutil.rmtree(folder, ignore_errors=True)
        shutil.copytree(whole, folder)
        contract = json.loads((folder / "contract.json").read_text())
        if seed % 3 == 0:
            data = damaged((folder / "contract.json").read_bytes(), seed)
        elif seed % 3 == 1:
            inner = contract["action"] if rng.integers(4) == 0 else contract
            inner[str(rng.choice(list(inner)))] = odd(rng)
            data = json.dumps(contract).encode()
        else:
            import hashlib

            model = damaged((folder / "policy.onnx").read_bytes(), seed)
            (folder / "policy.onnx").write_bytes(model)
            data = json.dumps({**contract, "onnx_sha256": hashlib.sha256(model).hexdigest()}).encode()
        (folder / "contract.json").write_bytes(data)
        try:
            loaded = ExportedPolicy.load(folder)
        except BadInput as error:
            assert str(error).isprintable() and len(str(error)) < 2000, f"policy, seed {seed}: {str(error)[:300]!r}"
        except Exception as error:
            pytest.fail(f"policy, seed {seed}: {type(error).__name__}: {error}")
        else:
            assert np.isfinite(loaded.scale).all(), f"policy, seed {seed}"


@SETTINGS
@given(
    st.text(max_size=60)
    | st.tuples(st.text(max_size=9), st.floats(), st.floats()).map(lambda t: f"{t[0]}#b#{t[1]}#{t[2]}")
)
def test_captions_of_any_text(line: str) -> None:
    try:
        _, _, start, end = parse_caption(line)
    except BadInput as error:
        assert str(error).isprintable()
    else:
        assert np.isfinite([start, end]).all()
