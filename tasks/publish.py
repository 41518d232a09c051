"""Stage publish: every policy becomes a version in the registry; the alias champion moves where promotion holds."""

import hashlib
import json
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import pandas as pd

from bumblebee.errors import BadInput
from bumblebee.evaluation.summary import compare
from bumblebee.policy.exported import ExportedPolicy
from bumblebee.ranges import Ranged
from tasks import registry
from tasks.approvals import gate, words
from tasks.approvals.promotion.gate import Promotion, PromotionConfig, settle
from tasks.approvals.promotion.rule import CHAMPION, Verdict, against_champion, against_parent, both, unchanged
from tasks.policies.came_along import seen_before
from tasks.policies.model_card import Evaluated, licences_of, model_card
from tasks.running import paths
from tasks.running.lineage import path_hash
from tasks.running.stage import load, log_run, output_file, run_stage
from tasks.sections import Loop, loop
from tasks.settings.rollouts_config import RolloutsConfig


@dataclass(frozen=True)
class PublishConfig(Ranged):
    """By which numbers policies are promoted."""

    engine: Literal["auto", "stand_in", "nominal"] = "auto"
    """The robot of the evaluation whose success decides; auto: the stand-in, or the declared model where the measured
    rollouts are of a real robot (`rollouts.source`), which the stand-in is not."""
    replace_incomparable: bool = False
    """Whether a new version takes @champion from one that was evaluated under another contract, so unseen which is
    better. The first version always becomes champion."""
    promotion: PromotionConfig = field(default_factory=PromotionConfig)
    """Who is asked before a version becomes champion."""


@dataclass(frozen=True)
class Candidate:
    """A policy on its way into the registry."""

    model: str
    """Registered name: base, expert-<cluster>, generalist."""
    policy: str
    """Name in the evaluation."""
    folder: Path
    """The exported policy."""
    parent: str | None
    """Name in the evaluation of the policy it was trained from, where both do the same task."""
    parent_folder: Path | None = None
    """That policy's folder."""


@dataclass(frozen=True)
class Standard:
    """Standard that a version is measured by."""

    contract: str
    """sha256 of the frozen evaluation."""
    engine: str
    """Its robot."""
    replace_incomparable: bool
    """As configured."""
    asks: bool = False
    """Whether a version that holds is proposed to people, and no champion yet."""


def main() -> None:
    """Register, promote, and write down what is published."""
    config, shape = load("publish", PublishConfig), loop()
    engine = deciding_engine(config.engine)
    summary = json.loads((paths.EVALUATION / "summary.json").read_text())
    episodes = pd.read_parquet(paths.EPISODES)
    contract = str(summary["contract_sha256"])
    models: dict[str, Any] = {}
    standard = Standard(contract, engine, config.replace_incomparable, config.promotion.mode == "ask")
    for candidate in candidates(shape):
        result = result_of(summary, candidate.policy, engine)
        if result is None:
            print(f"{candidate.policy}: not published, it has no results in the evaluation (no motion of its cluster)")
            continue
        before = models.get(candidate.model, {})
        facts = publish(candidate, result, standard, related(candidate, episodes, engine), before.get("proposal"))
        facts["versions"] = [*before.get("versions", []), facts["version"]]
        models[candidate.model] = facts
    content = {"schema": 1, "evaluation_contract": contract, "engine": engine, "models": models}
    if any("proposal" in facts for facts in models.values()):
        write(content)
        for name in [name for name, facts in models.items() if "proposal" in facts]:
            ask(Promotion(Path.cwd(), name), config.promotion.people)
    for name in models:
        models[name]["champion"] = registry.champion_version(name)
        made, champion, reason = (models[name][key] for key in ("version", "champion", "reason"))
        print(f"{name}: version {made}, champion is {champion} ({reason})")
    write(content)
    log_run("publish", params=config, tags={"evaluation_contract": contract})


def write(content: dict[str, Any]) -> None:
    """Write published.json."""
    with output_file(paths.PUBLISHED) as file:
        file.write_text(json.dumps(content, indent=1) + "\n")


def ask(place: Promotion, people: int) -> None:
    """Leave the request; where it was approved before, the version becomes champion."""
    table = gate.request(place, False, people)
    settle(place, table)
    waits = table["status"] in gate.WAITS
    print(words.how_to_answer(place.workspace, table) if waits else f"{place.model}: {words.said(table)}")


def candidates(shape: Loop) -> Iterator[Candidate]:
    """Every policy in the order in which it was trained, so that a later round meets its parent's version."""
    base = paths.BASE
    yield Candidate("base", "base", base, None)
    for cluster in shape.clusters:
        for number in range(shape.final_round + 1):
            folder = paths.expert(number, cluster)
            parent = f"expert-{cluster}-r{number - 1}" if number else "base"
            its_folder = paths.expert(number - 1, cluster) if number else base
            yield Candidate(f"expert-{cluster}", f"expert-{cluster}-r{number}", folder, parent, its_folder)
    yield Candidate("generalist", "generalist", paths.GENERALIST, None)


def is_unchanged(candidate: Candidate) -> bool:
    """Whether the policy is its parent, to the byte."""
    files = [folder / "policy.onnx" for folder in (candidate.folder, candidate.parent_folder) if folder is not None]
    if len(files) < 2 or not all(file.is_file() for file in files):
        return False
    return file_sha256(files[0]) == file_sha256(files[1])


def file_sha256(file: Path) -> str:
    """sha256 of a file."""
    with file.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def related(candidate: Candidate, episodes: pd.DataFrame, engine: str) -> Verdict:
    """The policy against its parent; one that is its parent is not compared with itself."""
    if candidate.parent is None:
        return against_parent(None)
    if is_unchanged(candidate):
        return unchanged(candidate.parent)
    return against_parent(compare(episodes, candidate.parent, candidate.policy, engine, "all"))


def deciding_engine(asked: str) -> str:
    """The engine whose success decides: as asked, or what fits the robot that was measured."""
    if asked != "auto":
        return asked
    return "stand_in" if load("rollouts", RolloutsConfig).source is None else "nominal"


def result_of(summary: dict[str, Any], policy: str, engine: str) -> dict[str, Any] | None:
    """The policy's numbers over all its motions; None where it was run on none.

    Raises:
        BadInput: when nothing was evaluated on the engine.
    """
    results = [entry for entry in summary["results"] if entry["engine"] == engine]
    if not results:
        raise BadInput(paths.EVALUATION / "summary.json", f"results on {engine}", "none", "Add it to evaluate.engines.")
    for entry in results:
        if (entry["policy"], entry["split"], entry["group_by"]) == (policy, "all", "all"):
            return dict(entry)
    return None


def publish(
    candidate: Candidate,
    result: dict[str, Any],
    standard: Standard,
    related: Verdict,
    proposed: dict[str, Any] | None = None,
) -> dict[str, Any]:
    """One version of one model, with its alias if it earns it; its facts for published.json.

    Args:
        candidate: the policy.
        result: its numbers.
        standard: by which it is measured.
        related: how it compares with its parent.
        proposed: an earlier version that waits to become champion: to be measured by in its place.
    """
    policy = ExportedPolicy.load(candidate.folder)
    champion = registry.champion_tags(candidate.model)
    if proposed is not None:
        champion = registry.version_tags(candidate.model, proposed["version"])
    best = against_champion(
        result["success"],
        champion,
        standard.contract,
        standard.engine,
        standard.replace_incomparable,
        policy.sha256,
    )
    verdict = both(related, best)
    metrics = {
        "success": result["success"]["value"],
        "mpjpe_rad": result["mpjpe_rad"]["value"],
        "mpkpe_mm": result["mpkpe_mm"]["value"],
    }
    tags = {"policy": candidate.policy, "onnx_sha256": policy.sha256}
    tags |= {"evaluation_contract": standard.contract, "evaluation_engine": standard.engine}
    tags |= {"dvc_policy": path_hash(candidate.folder), "promotion": verdict.reason}
    tags |= {name: f"{value:.6g}" for name, value in metrics.items() if value is not None}
    evaluated = Evaluated(standard.contract, standard.engine, result)
    licences = licences_of(paths.FILTERED)
    known = seen_before(paths.BASE)
    card = model_card(candidate.model, candidate.policy, candidate.folder, candidate.parent, evaluated, licences, known)
    version = registry.register(candidate.model, candidate.folder, tags, metrics, card)
    if verdict.promoted and not standard.asks:
        registry.set_alias(candidate.model, CHAMPION, version)
        registry.describe(candidate.model, card)
    facts: dict[str, Any] = {"version": version, "policy": candidate.policy, "folder": str(candidate.folder)}
    decided = {"unchanged": is_unchanged(candidate), "promoted": verdict.promoted, "reason": verdict.reason}
    facts |= {**decided, **metrics, "onnx_sha256": policy.sha256}
    if not standard.asks:
        return facts
    facts["promoted"] = False
    now = registry.champion_version(candidate.model)
    own = {key: facts[key] for key in ("version", "policy", "folder", "reason", *metrics, "onnx_sha256")}
    figures = {"success_ci95": result["success"]["ci95"], "evaluation_contract": standard.contract}
    proposal = {**own, **figures, "engine": standard.engine, "champion": now} if verdict.promoted else proposed
    if proposal is None or proposal["version"] == now:
        return facts
    return facts | {"proposal": proposal, "reason": f"{verdict.reason}; version {proposal['version']} asks people"}


if __name__ == "__main__":
    run_stage(main, logs=False)
