"""Each bad effects file and formula of the corpus is refused in one line, and nothing in it runs."""

from pathlib import Path

import pytest

from bumblebee.errors import BadInput
from bumblebee.sim.effects import read_effects, read_term
from tests.fuzz.corpora.effects_corpus import EFFECTS_FILES, TERMS


@pytest.mark.parametrize("name", EFFECTS_FILES)
def test_a_bad_effects_file_is_refused_in_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    monkeypatch.chdir(tmp_path)
    EFFECTS_FILES[name](tmp_path / "effects.yaml")
    with pytest.raises(BadInput) as caught:
        read_effects(tmp_path / "effects.yaml")
    assert str(caught.value).isprintable() and len(str(caught.value)) < 1500
    assert str(caught.value).startswith(str(tmp_path / "effects.yaml"))
    assert not (tmp_path / "executed").exists()


@pytest.mark.parametrize("name", TERMS)
def test_a_bad_formula_is_refused_in_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(BadInput) as caught:
        read_term(TERMS[name])
    assert str(caught.value).isprintable() and len(str(caught.value)) < 600
    assert not (tmp_path / "executed").exists()
