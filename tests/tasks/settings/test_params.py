"""A section of params.yaml becomes its dataclass, or one line that names file, key, what was expected and what came."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import pytest
from ruamel.yaml import YAML

from bumblebee.errors import BadInput
from tasks import sections
from tasks.settings.params import build, load, read


@dataclass(frozen=True)
class Inner:
    weights: dict[str, float] = field(default_factory=dict)
    limits: tuple[float, float] = (0.0, 1.0)


@dataclass(frozen=True)
class Config:
    iterations: int
    rate: float = 1e-3
    mode: Literal["ask", "auto"] = "ask"
    names: tuple[str, ...] = ()
    source: Path | None = None
    fast: bool = False
    inner: Inner = field(default_factory=Inner)


def text_of(values: object) -> str:
    with pytest.raises(BadInput) as caught:
        build(Config, values, "params.yaml", "base")
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_values_arrive_in_their_types_and_the_rest_has_its_default():
    values = {"iterations": 3, "rate": 1, "names": ["a", "b"], "source": "x/y", "inner": {"limits": [1, 2]}}
    config = build(Config, values, "params.yaml", "base")
    assert config == Config(3, 1.0, names=("a", "b"), source=Path("x/y"), inner=Inner(limits=(1.0, 2.0)))
    assert isinstance(config.rate, float)


@pytest.mark.parametrize("text", ["1e-4", "1.5e4", "2.E+3", "-1e3", "1.5E4"])
def test_a_number_with_an_exponent_is_a_number_as_it_is_for_dvc(text: str, tmp_path: Path):
    (tmp_path / "params.yaml").write_text(f"base: {{iterations: 1, rate: {text}}}\n")
    values = read(tmp_path / "params.yaml")["base"]
    assert build(Config, values, "params.yaml", "base").rate == YAML(typ="safe").load(f"v: {text}")["v"] == float(text)


@pytest.mark.parametrize("text", ["e4", "1.5e", "1.5e4 m", "0x1e4", ".5e1", ".e3", "1_0e3"])
def test_text_that_is_no_number_stays_text(text: str):
    with pytest.raises(BadInput, match="rate"):
        build(Config, {"iterations": 1, "rate": text}, "params.yaml", "base")


def test_an_unknown_key_is_named_with_the_nearest_known_one():
    text = text_of({"iteratoins": 3})
    assert "params.yaml: base.iteratoins" in text and "unknown key" in text and "Did you mean iterations?" in text


def test_a_nested_unknown_key_is_named_with_its_path():
    assert "base.inner.limit:" in text_of({"iterations": 1, "inner": {"limit": [0, 1]}})


def test_a_missing_key_without_default_is_named():
    assert text_of({}).startswith("params.yaml: base.iterations: expected a whole number, came nothing")


@pytest.mark.parametrize(
    ("values", "expected", "came"),
    [
        ({"iterations": "many"}, "a whole number", "'many' (str)"),
        ({"iterations": True}, "a whole number", "True (bool)"),
        ({"iterations": 1.5}, "a whole number", "1.5 (float)"),
        ({"iterations": 1, "rate": "fast"}, "a number", "'fast' (str)"),
        ({"iterations": 1, "mode": "later"}, "one of ask, auto", "'later' (str)"),
        ({"iterations": 1, "fast": 1}, "true or false", "1 (int)"),
        ({"iterations": 1, "names": "a"}, "a list of texts", "'a' (str)"),
        ({"iterations": 1, "inner": {"limits": [1]}}, "a list of 2 values", "[1] (list)"),
        ({"iterations": 1, "inner": {"weights": {"a": "b"}}}, "a number", "'b' (str)"),
        ({"iterations": 1, "source": 5}, "a path or nothing", "5 (int)"),
        ([1], "keys and values", "[1] (list)"),
    ],
)
def test_a_wrong_type_says_what_was_expected_and_what_came(values: object, expected: str, came: str):
    text = text_of(values)
    assert f"expected {expected}" in text and came in text


def test_a_missing_section_and_a_file_that_is_no_yaml(tmp_path: Path):
    file = tmp_path / "params.yaml"
    file.write_text("seal: {}\n")
    with pytest.raises(BadInput, match="motions: expected this section, came none"):
        load("motions", Config, file)
    file.write_text("seal: {\nbase: [\n")
    with pytest.raises(BadInput, match=r"params.yaml, line \d+: expected YAML"):
        load("seal", Config, file)
    with pytest.raises(BadInput, match="no file"):
        load("seal", Config, tmp_path / "none.yaml")


def test_an_unknown_section_is_named_whatever_section_is_read(tmp_path: Path):
    file = tmp_path / "params.yaml"
    file.write_text("seal: {iterations: 1}\nclutser: {}\n")
    with pytest.raises(BadInput, match=r"clutser: expected a known section.*Did you mean cluster\?"):
        load("seal", Config, file)


def shape_error(tmp_path: Path, text: str) -> str:
    file = tmp_path / "params.yaml"
    file.write_text(text)
    with pytest.raises(BadInput) as caught:
        sections.loop(file)
    return str(caught.value)


def test_rounds_form_a_chain_and_the_final_round_exists(tmp_path: Path):
    file = tmp_path / "params.yaml"
    file.write_text("clusters: [c0]\nrounds: [{n: 1, parent: 0}, {n: 2, parent: 1}]\nfinal_round: 2\n")
    assert [r.n for r in sections.loop(file).rounds] == [1, 2]
    skipped = "clusters: [c0]\nrounds: [{n: 1, parent: 0}, {n: 3, parent: 1}]\nfinal_round: 1\n"
    assert "rounds[1]: expected n: 2, parent: 1" in shape_error(tmp_path, skipped)
    too_late = "clusters: [c0]\nrounds: [{n: 1, parent: 0}]\nfinal_round: 2\n"
    assert "final_round: expected 0 to 1" in shape_error(tmp_path, too_late)
    assert "rounds[0].parent: expected a whole number" in shape_error(
        tmp_path, "clusters: [c0]\nrounds: [{n: 1}]\nfinal_round: 0\n"
    )


def test_a_loop_without_rounds_is_one(tmp_path: Path):
    file = tmp_path / "params.yaml"
    file.write_text("clusters: [c0]\nrounds: []\nfinal_round: 0\n")
    assert sections.loop(file).rounds == ()


@pytest.mark.parametrize("clusters", ["[]", "[a, a]", "[a b]", "['../x']"])
def test_clusters_have_distinct_plain_names(tmp_path: Path, clusters: str):
    assert "clusters: expected" in shape_error(tmp_path, f"clusters: {clusters}\nrounds: []\nfinal_round: 0\n")


def test_a_file_that_was_checked_is_checked_again_only_when_it_changed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The loop checks the whole file while its servers start; its first stage need not do so again."""
    monkeypatch.chdir(tmp_path)
    file, checked = Path("params.yaml"), []
    monkeypatch.setattr(sections, "check", lambda path: checked.append(path.read_text()))
    file.write_text("a: 1\n")
    sections.main()
    sections.check_once()
    file.write_text("a: 2\n")
    sections.check_once()
    sections.check_once()
    assert checked == ["a: 1\n", "a: 2\n"]
