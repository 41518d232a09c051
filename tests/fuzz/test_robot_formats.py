"""Damaged CSV headers, pickles and `.npz` files of robot motion: a motion that passes the checks or one line."""

import io
import os
import pickle
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from bumblebee.errors import BadInput
from bumblebee.motion.formats.read import RobotConfig, is_robot_npz, read_robot
from bumblebee.motion.formats.write import mjlab_npz
from bumblebee.motion.reading.usable import usable
from bumblebee.robot.facts import joint_names
from tests.fuzz.budget import rounds
from tests.fuzz.motion_files import clip, fields, table

SHARE = 1 / 4  # of the file's seconds, for each test
START = int.from_bytes(os.urandom(4), "little") if "BUMBLEBEE_FUZZ_SECONDS" in os.environ else 0
CONFIG = RobotConfig(csv_fps=30, joints_23="asap")
WORDS = (b"nan", b"inf", b"-1e200", b"0", b"", b",", b"\n", b'"', b"Frame", b"_dof", b"waist_yaw", b"w", b"x", b"1_0")


def outcome(read: Callable[[], list], how: str) -> None:
    """A reader's result may fail the checks in one line; nothing else may come of it."""
    try:
        for raw in read():
            assert np.isfinite(raw.fps) and raw.joint_pos.shape == (len(raw.root_pos), len(joint_names())), how
            usable(raw)
    except BadInput as error:
        assert str(error).isprintable() and len(str(error)) < 2000, f"{how}: {str(error)[:300]!r}"
    except Exception as error:
        pytest.fail(f"{how}: {type(error).__name__}: {error}")


def damaged(data: bytes, rng: np.random.Generator) -> bytes:
    """Bytes replaced, cut out, doubled, or overwritten with words that the readers know."""
    out = bytearray(data)
    for _ in range(int(rng.integers(1, 5))):
        at = int(rng.integers(0, len(out) + 1))
        end, kind = at + int(rng.integers(1, 40)), int(rng.integers(5))
        if kind == 0 and out:
            out[min(at, len(out) - 1)] = int(rng.integers(256))
        elif kind == 1:
            del out[at:end]
        elif kind == 2:
            out[at:at] = out[at:end]
        elif kind == 3:
            out[at:end] = rng.choice(np.array(WORDS, dtype=object))
        else:
            del out[at:]
    return bytes(out)


def soma_csv() -> bytes:
    values = table(24)
    euler = np.rad2deg(np.stack([0 * values[:, 3], 0 * values[:, 3], 2 * np.arcsin(values[:, 5])], axis=1))
    rows = np.concatenate([np.arange(24)[:, None], values[:, :3] * 100, euler, np.rad2deg(values[:, 7:])], axis=1)
    root = [f"root_{what}{axis}" for what in ("translate", "rotate") for axis in "XYZ"]
    header = ",".join(["Frame", *root, *(f"{name}_dof" for name in joint_names())])
    return "\n".join([header, *(",".join(f"{value:.5f}" for value in row) for row in rows)]).encode()


def test_damaged_headers_and_rows() -> None:
    whole = soma_csv()
    assert len(read_robot(Path("a.csv"), whole, CONFIG)) == 1
    for seed in (START + number for number in rounds(SHARE)):
        data = damaged(whole, np.random.default_rng(seed))
        outcome(partial(read_robot, Path("a.csv"), data, CONFIG), f"header, seed {seed}")


def test_damaged_npz_files() -> None:
    whole = mjlab_npz(clip())
    assert len(read_robot(Path("a.npz"), whole)) == 1
    for seed in (START + number for number in rounds(SHARE)):
        data = damaged(whole, np.random.default_rng(seed))
        is_robot_npz(data)
        outcome(partial(read_robot, Path("a.npz"), data), f"npz, seed {seed}")


SHAPES = ((), (0,), (24,), (24, 0), (24, 29), (24, 36), (24, 23), (24, 30, 3), (24, 30, 4), (24, 14, 4), (24, 2**12, 3))


def strange(rng: np.random.Generator) -> np.ndarray:
    """An array of any shape and type, with what no number is."""
    kind = rng.choice(["f4", "f8", "i8", "?", "c8", "U5", "M8[s]", "f2"])
    values = rng.normal(size=SHAPES[int(rng.integers(len(SHAPES)))]) * 10.0 ** int(rng.integers(-3, 200))
    if rng.random() < 0.5 and values.size:
        values.reshape(-1)[int(rng.integers(values.size))] = rng.choice([np.nan, np.inf, -np.inf])
    with np.errstate(all="ignore"):
        return values.astype("f8").astype(kind) if kind not in ("i8", "M8[s]") else np.zeros(values.shape, kind)


@pytest.mark.filterwarnings("ignore")
def test_fields_that_are_not_what_they_should_be() -> None:
    with np.load(io.BytesIO(mjlab_npz(clip()))) as file:
        whole = dict(file)
    asap = {**fields(24), "pose_aa": np.zeros((24, 27, 3))}
    for seed in (START + number for number in rounds(2 * SHARE)):
        rng = np.random.default_rng(seed)
        content = dict(whole if seed % 2 else asap)
        for _ in range(int(rng.integers(1, 4))):
            content[str(rng.choice(list(content)))] = strange(rng)
        stream = io.BytesIO()
        np.savez(stream, **content)
        files = {"a.npz": stream.getvalue(), "a.pkl": pickle.dumps({"a": content})}
        for name, data in files.items() if not seed % 2 else [("a.npz", files["a.npz"])]:
            outcome(partial(read_robot, Path(name), data), f"{name} of strange fields, seed {seed}")
