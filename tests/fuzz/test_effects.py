"""Damaged effects files and formulas of any signs: effects of finite numbers or one line, and nothing else."""

import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from bumblebee.errors import BadInput
from bumblebee.sim.effects import CATALOGUE, read_effects, read_term
from tests.fuzz.budget import SECONDS, rounds
from tests.fuzz.motion_files import EFFECTS

START = int.from_bytes(os.urandom(4), "little") if "BUMBLEBEE_FUZZ_SECONDS" in os.environ else 0
WORDS = ("[", "]", "{", "}", "&a ", "*a", "!!", "? ", ": ", "- ", "\n", "\t", "|", ">", "%", "\0", "\ud7ff", ".nan",
         ".inf", "1e999", "null", "true", "'", '"', "#", "<<: ", "---\n", "2020-13-99", "0x", "1:2:3", "=")  # fmt: skip
SCALARS = st.one_of(st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=12), st.just(10**400))
ANYTHING = st.recursive(
    SCALARS, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=6), inner, max_size=3)
)


SETTINGS = settings(
    max_examples=max(20, int(SECONDS * 20)),
    deadline=None,
    database=None,
    derandomize=START == 0,
    suppress_health_check=list(HealthCheck),
)


def outcome(path: Path, how: str) -> None:
    try:
        effects = read_effects(path)
    except BadInput as error:
        assert str(error).isprintable() and len(str(error)) < 2000, f"{how}: {str(error)[:300]!r}"
        return
    except Exception as error:
        pytest.fail(f"{how}: {type(error).__name__}: {error}")
    for effect in effects:
        assert effect.effect in CATALOGUE, how
        assert all(np.isfinite(value) and abs(value) <= 1e9 for value in effect.parameters.values()), how


def test_damaged_effects_files(tmp_path: Path) -> None:
    path = tmp_path / "effects.yaml"
    for number in rounds(0.4):
        seed = START + number
        rng = np.random.default_rng(seed)
        out = EFFECTS
        for _ in range(int(rng.integers(1, 4))):
            at = int(rng.integers(len(out) + 1))
            out = out[:at] + str(rng.choice(WORDS)) * int(rng.integers(1, 4)) + out[at + int(rng.integers(6)) :]
        data = bytearray(out.encode("utf-8", "surrogatepass"))
        if seed % 4 == 0:
            data[int(rng.integers(len(data)))] = int(rng.integers(256))
        path.write_bytes(data)
        outcome(path, f"effects, seed {seed}")


@settings(SETTINGS, max_examples=max(20, int(SECONDS * 5)))
@given(
    st.fixed_dictionaries(
        {"effect": st.sampled_from(sorted(CATALOGUE)) | SCALARS, "where": st.just(["j"]) | ANYTHING},
        optional={"parameters": ANYTHING, "more": SCALARS},
    ),
    st.sampled_from(sorted(CATALOGUE)),
    SCALARS,
)
def test_effects_of_anything(tmp_path_factory: pytest.TempPathFactory, entry: dict, name: str, value: object) -> None:
    import yaml

    good = {"effect": name, "where": ["j"], "parameters": dict.fromkeys(CATALOGUE[name].names, value)}
    path = tmp_path_factory.mktemp("effects") / "effects.yaml"
    for entries in ([entry], [good], [good, entry]):
        text = yaml.dump({"schema": 1, "effects": entries})
        path.write_bytes(text.encode("utf-8", "surrogatepass"))
        outcome(path, text[:2000])


PIECES = st.sampled_from(
    [*"qvut+-*/^(),[]. 0123456789", "tau", "sin(", "curve(", "stair(", "bound(", "rested(", "slewed(", "friction(",
     "relu(", "1e999", "q[a]", "**", "//", "lambda ", "if ", "else ", " for ", " in ", "True", "None", "'a'", "1j", "_",
     "\0", "=", ":=", "0.5", "q, 0, 0, 1, 1)", "q,"]
)  # fmt: skip


@SETTINGS
@given(st.lists(PIECES, max_size=14).map("".join) | st.text(max_size=30))
def test_formulas_of_any_signs(text: str) -> None:
    try:
        term = read_term(text)
    except BadInput as error:
        assert str(error).isprintable()
        return
    rng = np.random.default_rng(0)
    values = {name: rng.standard_normal(3) for name in ("q", "v", "u", "tau", "t", *(name for name, _ in term.states))}
    values |= {f"{own}[{name}]": rng.standard_normal(3) for own in ("q", "v", "tau") for name in term.others}
    with np.errstate(all="ignore"):
        assert np.shape(term(values)) in ((), (3,)), text
