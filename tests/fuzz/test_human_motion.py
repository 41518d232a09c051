"""Damaged motions of people and archives: finite landmarks or one line, and nothing else."""

import io
import tarfile
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from bumblebee.errors import BadInput
from bumblebee.motion.human.motion import LANDMARKS, HumanMotion
from bumblebee.motion.human.read import HumanConfig, read_human
from bumblebee.motion.reading.walk import motion_sources
from tests.fuzz.test_motion import damaged, each
from tests.motion.human.people import bvh, npz, smpl

SHARE = 1 / 5  # of the file's seconds, for each test
CONFIG = HumanConfig(fps=30.0)
WORDS = (
    "CHANNELS",
    "OFFSET",
    "{",
    "}",
    "End Site",
    "ROOT a",
    "JOINT b",
    "MOTION",
    "Frames: 3",
    "-0",
    "1e9",
    "nan",
    "\n",
)


def outcome(read: Callable[[], list[HumanMotion]], how: str) -> None:
    """Run a reader: what it returns must be right, what it raises must be one line; `how` says it again."""
    try:
        motions = read()
    except BadInput as error:
        assert str(error).isprintable() and len(str(error)) < 2000, f"{how}: {str(error)[:300]!r}"
        return
    except Exception as error:
        pytest.fail(f"{how}: {type(error).__name__}: {error}")
    for motion in motions:
        assert motion.positions.shape[1:] == (len(LANDMARKS), 3) and len(motion.positions) >= 2, how
        assert np.isfinite(motion.positions).all() and 1 <= motion.fps <= 1000, how


def test_damaged_bvh_files() -> None:
    whole = bvh(frames=30).encode()
    for seed in each(SHARE):
        data = damaged(whole, seed)
        outcome(lambda data=data: read_human(Path("a.bvh"), data, CONFIG), f"bvh, seed {seed}")


def test_bvh_files_with_words_exchanged() -> None:
    words = bvh(frames=3).replace("\n", " \n ").split(" ")
    for seed in each(SHARE):
        rng, text = np.random.default_rng(seed), list(words)
        for _ in range(int(rng.integers(1, 6))):
            text[int(rng.integers(len(text)))] = str(rng.choice(WORDS if rng.integers(2) else words))
        data = " ".join(text).encode()
        outcome(lambda data=data: read_human(Path("a.bvh"), data, CONFIG), f"words, seed {seed}")


def odd_array(rng: np.random.Generator) -> object:
    """Something that stands where it should not."""
    things = (np.zeros(0), np.zeros((0, 3)), np.full((9, 72), 1e300), np.zeros((9, 3), dtype=complex), np.array("x"),
              np.array(7), np.full((9, 3), np.nan), np.zeros((9, 156), dtype=bool), np.zeros((2, 2, 2)), np.array(-1),
              np.array(b"male"), np.full((9, 3), 2**63, dtype=np.uint64), np.array([[1e-30] * 10]))  # fmt: skip
    return things[rng.integers(len(things))]


def test_npz_files_damaged_and_with_odd_arrays() -> None:
    whole = npz(smpl(frames=9))
    for seed in each(SHARE):
        rng, arrays = np.random.default_rng(seed), smpl(frames=9)
        for _ in range(int(rng.integers(1, 3))):
            arrays[str(rng.choice(list(arrays)))] = odd_array(rng)
        data = damaged(whole, seed) if seed % 2 else npz(arrays)
        outcome(lambda data=data: read_human(Path("a.npz"), data, CONFIG), f"npz, seed {seed}")


def archived(kind: str) -> bytes:
    stream, data = io.BytesIO(), bvh(frames=3).encode()
    if kind == ".zip":
        with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as out:
            for name in ("a.bvh", "in/b.bvh"):
                out.writestr(name, data)
    else:
        with tarfile.open(fileobj=stream, mode="w" if kind == ".tar" else "w:gz") as tar:
            for name in ("a.bvh", "in/b.bvh"):
                info = tarfile.TarInfo(name)
                info.size = len(data)
                tar.addfile(info, io.BytesIO(data))
    return stream.getvalue()


@pytest.mark.parametrize("kind", [".zip", ".tar", ".tgz"])
def test_damaged_archives(tmp_path: Path, kind: str) -> None:
    whole = archived(kind)
    for seed in each(SHARE / 2):
        path = tmp_path / f"{seed}{kind}"
        path.write_bytes(damaged(whole, seed))
        try:
            for source in motion_sources(path):
                assert source.path == path or path in source.path.parents
                outcome(lambda source=source: [][len(source.read(1 << 20)) :], f"{kind}, seed {seed}")
        except Exception as error:
            pytest.fail(f"{kind}, seed {seed}: {type(error).__name__}: {error}")
        path.unlink()
