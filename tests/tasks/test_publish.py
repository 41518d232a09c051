"""Publishing: which robot decides, and what happens to a policy that was evaluated on nothing."""

import json
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from bumblebee.errors import BadInput
from bumblebee.evaluation.summary import COLUMNS, results
from bumblebee.learning.export import write_export
from bumblebee.tracking.sampling.library import AHEAD
from tasks import publish
from tests.policy.conftest import linear_onnx

PARAMS = "clusters: [c0, c1]\nrounds: []\nfinal_round: 0\npublish: {}\nrollouts: {}\n"


class Registry:
    """Versions and champions in memory, in place of MLflow's."""

    def __init__(self) -> None:
        self.versions: list[tuple[str, dict[str, str]]] = []
        self.champions: dict[str, str] = {}
        self.cards: dict[str, str] = {}
        self.described: dict[str, str] = {}

    def register(self, name: str, folder: Path, tags: dict[str, str], metrics: dict[str, Any], card: str) -> str:
        self.cards[name] = card
        self.versions.append((name, tags))
        return str(len(self.versions))

    def set_alias(self, name: str, alias: str, version: str) -> None:
        self.champions[name] = version

    def describe(self, name: str, text: str) -> None:
        self.described[name] = text

    def champion_version(self, name: str) -> str | None:
        return self.champions.get(name)

    def champion_tags(self, name: str) -> dict[str, str] | None:
        return self.versions[int(self.champions[name]) - 1][1] if name in self.champions else None


@pytest.fixture
def registry(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Registry:
    """In a workspace where every policy succeeds; expert-c1 has no motion."""
    monkeypatch.chdir(tmp_path)
    made = Registry()
    monkeypatch.setattr(publish, "registry", made)
    monkeypatch.setattr(publish, "path_hash", lambda folder: "hash")
    monkeypatch.setattr(publish, "log_run", lambda *_, **__: None)
    Path("params.yaml").write_text(PARAMS)
    for folder in ("models/base", "models/experts/r0/c0", "models/experts/r0/c1", "models/generalist"):
        Path(folder).mkdir(parents=True)
        write_export(Path(folder), linear_onnx(0.0), AHEAD)
    evaluated("abc")
    return made


def evaluated(contract: str, engines: tuple[str, ...] = ("nominal", "stand_in")) -> None:
    policies = (("base", "base", None), ("expert-c0-r0", "expert", 0), ("generalist", "generalist", None))
    rows = [
        (policy, kind, number, "c0", "wave", "stand", "train", engine, 0, True, 0.1, 30.0, 50, "end")
        for policy, kind, number in policies
        for engine in engines
    ]
    episodes = pd.DataFrame(rows, columns=list(COLUMNS)).astype({"round": "Int64"})
    Path("data/evaluation").mkdir(parents=True, exist_ok=True)
    episodes.to_parquet("data/evaluation/episodes.parquet")
    summary = {"contract_sha256": contract, "results": results(episodes)}
    Path("data/evaluation/summary.json").write_text(json.dumps(summary))


def trained_again(gain: float = 0.01) -> None:
    """Other weights for every policy."""
    for file in list(Path("models").rglob("policy.onnx")):
        write_export(file.parent, linear_onnx(gain), AHEAD)


def written() -> dict[str, Any]:
    return json.loads(Path("data/published.json").read_text())


def test_an_expert_without_results_is_left_out_and_named(
    registry: Registry, capsys: pytest.CaptureFixture[str]
) -> None:
    publish.main()
    assert set(written()["models"]) == {"base", "expert-c0", "generalist"} == set(registry.champions)
    assert "expert-c1-r0: not published" in capsys.readouterr().out
    assert registry.described == registry.cards and "- from: base" in registry.cards["expert-c0"]


def test_an_engine_that_was_not_evaluated_is_refused_with_its_key(registry: Registry) -> None:
    evaluated("abc", engines=("nominal",))
    with pytest.raises(BadInput, match=r"evaluate\.engines"):
        publish.main()
    assert not registry.versions


def test_with_a_real_robot_the_declared_model_decides(registry: Registry) -> None:
    publish.main()
    assert written()["engine"] == "stand_in"
    Path("params.yaml").write_text(PARAMS.replace("rollouts: {}", "rollouts: {source: mine}"))
    publish.main()
    assert written()["engine"] == "nominal"


def test_after_a_change_of_the_evaluation_the_champion_stays_until_it_is_asked_to_go(registry: Registry) -> None:
    publish.main()
    first = dict(registry.champions)
    trained_again()
    evaluated("another")
    publish.main()
    assert registry.champions == first and len(registry.versions) == 2 * len(first)
    assert "another contract" in written()["models"]["base"]["reason"]
    Path("params.yaml").write_text(PARAMS.replace("publish: {}", "publish: {replace_incomparable: true}"))
    publish.main()
    assert all(int(registry.champions[name]) > int(version) for name, version in first.items())


def test_a_policy_that_is_its_parents_file_is_said_to_be_unchanged_and_not_compared(
    registry: Registry, monkeypatch: pytest.MonkeyPatch
) -> None:
    compared: list[tuple[str, str]] = []
    monkeypatch.setattr(publish, "compare", lambda _, first, second, *__: compared.append((first, second)))
    publish.main()
    assert not compared
    facts = written()["models"]["expert-c0"]
    assert facts["unchanged"] and facts["reason"] == "unchanged: the same file as its parent base; the first version"
    assert not written()["models"]["base"]["unchanged"] and not written()["models"]["generalist"]["unchanged"]
    write_export(Path("models/experts/r0/c0"), linear_onnx(0.01), AHEAD)
    publish.main()
    assert compared == [("base", "expert-c0-r0")] and not written()["models"]["expert-c0"]["unchanged"]


def test_the_alias_stays_on_a_champion_of_the_same_file_and_follows_it_into_another_evaluation(
    registry: Registry,
) -> None:
    publish.main()
    first = dict(registry.champions)
    publish.main()
    assert registry.champions == first
    assert written()["models"]["base"]["reason"].endswith("the champion is the same file and stays")
    evaluated("another")
    publish.main()
    assert all(registry.champion_tags(name)["evaluation_contract"] == "another" for name in first)
