"""Damaged tables of captions, caption files, indexes and archives of HumanML3D: captions in their form, or one line."""

import os
from pathlib import Path

import numpy as np
import pytest

from bumblebee.errors import BadInput
from bumblebee.motion.captions import parse_caption
from bumblebee.motion.describe.accounting import account
from bumblebee.motion.describe.describer import DescribeConfig, describer
from tests.fuzz.budget import rounds
from tests.motion.describe.small_humanml3d import INDEX, TEXTS, put_humanml3d

START = int.from_bytes(os.urandom(4), "little") if "BUMBLEBEE_FUZZ_SECONDS" in os.environ else 0
SHARE = 0.1  # of the file's seconds, for each test
WORDS = ("nan", "inf", "-1", "1e400", "", ",", "\n", "\0", '"', "#", "/", "..", "\x1b", "M", "_", "९", "\r", "PK\5\6")
TABLE = 'motion,caption,from,to\n01_01,"a person walks, slowly",0.5,2\ncmu/01_01.bvh,a person turns,,\n'
FILE = "a person walks.#a/DET person/NOUN walk/VERB#0.5#2.0\nthey turn#they/PRON turn/VERB#nan#nan\n"
DURATION = 12.0


def damaged(data: bytes, rng: np.random.Generator) -> bytes:
    out = bytearray(data)
    for _ in range(int(rng.integers(1, 5))):
        at = int(rng.integers(len(out) + 1))
        if rng.random() < 0.5:
            out[at : at + int(rng.integers(9))] = str(rng.choice(WORDS)).encode("utf-8", "surrogatepass")
        elif rng.random() < 0.8:
            out[at : at + int(rng.integers(1, 9))] = rng.bytes(int(rng.integers(9)))
        else:
            del out[at:]
    return bytes(out)


def outcome(config: DescribeConfig, root: Path, how: str) -> None:
    """Captions given must be within the motion, what is not must be one line, and all must add up."""
    try:
        say = describer(config, root)
        told = say.captions(root / "cmu" / "01_01.bvh", "01_01", DURATION)
        total = account(say, [told])
    except BadInput as error:
        assert str(error).isprintable() and len(str(error)) < 2000, f"{how}: {str(error)[:300]!r}"
        return
    except Exception as error:
        pytest.fail(f"{how}: {type(error).__name__}: {error}")
    for line in told.captions:
        _, _, since, until = parse_caption(line)
        assert since == until == 0 or 0 <= since < until <= DURATION, how
    assert bool(told.captions) == bool(told.source), how
    for note in (*told.notes, *total.notes, *total.several):
        assert len(note) < 2000 and "\n" not in note, how
    if say.table is not None:
        assert sum(total.rows.values()) == len(say.table.rows) + len(say.table.bad), how


def each(tmp_path: Path, name: str, whole: bytes, config: DescribeConfig) -> None:
    for number in rounds(SHARE):
        (tmp_path / name).write_bytes(damaged(whole, np.random.default_rng(START + number)))
        outcome(config, tmp_path, f"{name}, seed {START + number}")


def test_damaged_tables_of_captions(tmp_path: Path) -> None:
    each(tmp_path, "captions.csv", TABLE.encode(), DescribeConfig(captions_csv=str(tmp_path / "captions.csv")))


def test_damaged_caption_files(tmp_path: Path) -> None:
    (tmp_path / "cmu").mkdir()
    each(tmp_path, "cmu/01_01.txt", FILE.encode(), DescribeConfig())


def test_damaged_indexes_of_humanml3d(tmp_path: Path) -> None:
    put_humanml3d(tmp_path)
    each(tmp_path, "index.csv", INDEX.encode(), DescribeConfig(humanml3d=str(tmp_path)))


def test_damaged_archives_of_humanml3d(tmp_path: Path) -> None:
    put_humanml3d(tmp_path)
    each(tmp_path, "texts.zip", (tmp_path / "texts.zip").read_bytes(), DescribeConfig(humanml3d=str(tmp_path)))


def test_damaged_texts_of_humanml3d(tmp_path: Path) -> None:
    put_humanml3d(tmp_path, packed=False)
    each(tmp_path, "texts/000001.txt", TEXTS["000001"].encode(), DescribeConfig(humanml3d=str(tmp_path)))
