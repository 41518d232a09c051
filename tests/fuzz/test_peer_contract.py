"""Damaged contract files of peers: a contract whose numbers are finite, or one line, and nothing else."""

import copy
import os
from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from bumblebee.errors import BadInput
from bumblebee.peers import CONTRACTS
from bumblebee.peers.contract import read_contract
from tests.fuzz.budget import rounds
from tests.fuzz.test_effects import ANYTHING, SETTINGS, WORDS
from tests.peers.peer import table

TEXT = CONTRACTS["twist2"].read_text()
START = int.from_bytes(os.urandom(4), "little") if "BUMBLEBEE_FUZZ_SECONDS" in os.environ else 0
PLACES = [
    *((key,) for key in table()),
    ("joints", 3),
    ("kp", 0),
    *(("action", key) for key in ("scale", "clip", "around", "remembered")),
    ("groups", "robot"),
    *(("groups", "robot", 1, key) for key in ("term", "scale", "zero", "axes", "step")),
    *(("input", 1, key) for key in ("groups", "past", "now", "order", "stacked", "begin")),
    ("input", 0),
]


def outcome(path: Path, how: str) -> None:
    try:
        contract = read_contract(path)
    except BadInput as error:
        assert str(error).isprintable() and len(str(error)) < 2000, f"{how}: {str(error)[:300]!r}"
        return
    except Exception as error:
        pytest.fail(f"{how}: {type(error).__name__}: {error}")
    assert np.isfinite([*contract.kp, *contract.kd, *contract.default_pos, *contract.action.scale]).all(), how
    assert contract.width > 0, how


def test_damaged_files(tmp_path: Path):
    path = tmp_path / "c.yaml"
    for number in rounds(0.4):
        rng = np.random.default_rng(START + number)
        out = TEXT
        for _ in range(int(rng.integers(1, 4))):
            at = int(rng.integers(len(out) + 1))
            out = out[:at] + str(rng.choice(WORDS)) * int(rng.integers(1, 4)) + out[at + int(rng.integers(6)) :]
        path.write_bytes(out.encode("utf-8", "surrogatepass"))
        outcome(path, f"seed {START + number}")


@SETTINGS
@given(place=st.sampled_from(PLACES), value=ANYTHING)
def test_any_value_in_any_field(tmp_path_factory: pytest.TempPathFactory, place: tuple, value: object):
    path = tmp_path_factory.getbasetemp() / "peer.yaml"
    inner = made = copy.deepcopy(table())
    for key in place[:-1]:
        inner = inner[key]
    inner[place[-1]] = value
    path.write_text(yaml.safe_dump(made), encoding="utf-8", errors="surrogatepass")
    outcome(path, f"{place}: {value!r}")
