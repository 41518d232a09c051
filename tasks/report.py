"""Stage report: everything that the loop found, on one page that holds all it needs: reports/report.html."""

import json
from collections.abc import Iterator
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from bumblebee.evaluation.summary import comparisons
from bumblebee.measured.rollout import read_rollout
from bumblebee.measured.wire_note import noted_latency
from bumblebee.motion.store import read_index
from bumblebee.ranges import Line, Ranged, Seed
from bumblebee.report.charts.loop_picture import Box, loop_picture
from bumblebee.report.names import reference, same_files
from bumblebee.report.page import render
from bumblebee.report.results import LoopResults, RoundResults
from bumblebee.report.sections.clusters_section import clusters_section
from bumblebee.report.sections.data_sections import motions_section
from bumblebee.report.sections.opening import headline, opening, opening_lines
from bumblebee.report.sections.policy_sections import registry_section, success_section, training_section
from bumblebee.report.sections.round_sections import round_section
from bumblebee.report.wording import plural
from tasks.pages.film import film_blocks
from tasks.pages.replays import replays
from tasks.policies.came_along import began
from tasks.running import paths
from tasks.running.lineage import git_sha
from tasks.running.stage import load, log_run, output_file, run_stage
from tasks.sections import Loop, Round, loop
from tasks.settings.rollouts_config import RolloutsConfig


@dataclass(frozen=True)
class ReportConfig(Ranged):
    """Settings of what the page shows beside the numbers."""

    title: Line = ""
    """The page's heading; empty: what the loop found."""
    film: bool = True
    """Run a motion that the round won back on the stand-in robot, before and after, and show both."""
    film_motion: Line = ""
    """Motion of the film; empty: the liveliest that was won back, else the liveliest that the generalist follows."""
    seed: Seed = 3
    """Seed of the start state and the sensor noise where no motion was won back and one run is shown alone."""


def main() -> None:
    """Write the page."""
    config, shape = load("report", ReportConfig), loop()
    results = collect(shape)
    seen, players = replays(results)
    results = replace(results, players=players)
    sections = [motions_section(results), clusters_section(results), training_section(results)]
    sections += [round_section(results, turn) for turn in results.rounds]
    sections += [success_section(results), registry_section(results)]
    film = film_blocks(results, config.film_motion, config.seed) if config.film and not results.real_robot else []
    when = datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")
    subtitle = (
        f"BumbleBee · {when} · code {git_sha()[:12]} · evaluation contract {results.evaluation['contract_sha256'][:12]}"
    )
    page = render(config.title or headline(results), subtitle, picture(results), sections, opening(results, film), seen)
    with output_file(paths.REPORT) as file:
        file.write_text(page)
    print(f"report: {paths.REPORT} ({paths.REPORT.stat().st_size / 1e6:.1f} MB)")
    for line in opening_lines(results):
        print(f"  {line}")
    log_run("report", params=config)


def collect(shape: Loop) -> LoopResults:
    """Read what the stages left."""
    library, evaluation = read_index(paths.MOTIONS), _json(paths.EVALUATION / "summary.json")
    base, wire = _json(paths.BASE / "card.json"), wire_latency(shape)
    return LoopResults(
        library=library,
        skipped=_table(paths.MOTIONS / "skipped.csv", ("file", "reason")),
        drops=_table(paths.FILTERED / "drops.csv", ("motion", "rule", "explanation")),
        labels=pd.read_parquet(paths.LABELS),
        elbow=pd.read_csv(paths.CLUSTERS / "elbow.csv"),
        clusters=_json(paths.CLUSTERS / "summary.json"),
        curves=dict(curves(shape)),
        learners=dict(learners(shape)),
        evaluation=with_reference(evaluation),
        contract=_json(paths.EVALUATION / "contract.json"),
        published=_json(paths.PUBLISHED),
        sealed=sealed_truth(wire),
        rounds=tuple(round_results(turn, shape.clusters) for turn in shape.rounds if turn.n <= shape.final_round),
        began=began(paths.BASE),
        base_trained_on=base.get("kept") != "parent",
        points=pd.read_parquet(points) if (points := paths.CLUSTERS / "map.parquet").exists() else None,
        wire=wire,
    )


def with_reference(evaluation: dict[str, Any]) -> dict[str, Any]:
    """The evaluation with every policy compared with the one that the loop began with, where it is not yet."""
    first = reference(evaluation)
    names = list(dict.fromkeys(entry["policy"] for entry in evaluation["results"]))
    there = {(c["from"], c["to"]) for c in evaluation["comparisons"]}
    lacking = [(first, name) for name in names if name not in (first, "untrained") and (first, name) not in there]
    more = comparisons(pd.read_parquet(paths.EPISODES), lacking)
    unchanged = [{"unchanged": True} if same_files(evaluation, first, c["to"]) else {} for c in more]
    added = [{**c, **mark} for c, mark in zip(more, unchanged, strict=True)]
    return {**evaluation, "comparisons": [*evaluation["comparisons"], *added]}


def sealed_truth(wire: float | None = None) -> dict[str, Any] | None:
    """Sealed effects of the stand-in, and the latency of its `wire` [s]; None where the robot is the user's."""
    if load("rollouts", RolloutsConfig).source is not None:
        return None
    sealed = _json(paths.SEALED_ROBOT)
    late = {"effect": "command_delay", "where": [], "parameters": {"delay": wire}, "unit": "s"}
    return sealed if wire is None else {**sealed, "effects": [*sealed["effects"], late]}


def wire_latency(shape: Loop) -> float | None:
    """Median latency of the wire [s] that the stand-in's rollouts note; None where they came over none."""
    config = load("rollouts", RolloutsConfig)
    if config.source is not None or config.wire == "none":
        return None
    folders = [paths.rollouts(turn.n, cluster) for turn in shape.rounds for cluster in shape.clusters]
    files = [file for folder in folders for file in (folder / "rollouts").glob("*.parquet")]
    noted = [noted_latency(str(read_rollout(file).meta.get("notes", ""))) for file in files]
    return float(np.median(known)) if (known := [late for late in noted if late is not None]) else None


def folders_of(shape: Loop) -> dict[str, Path]:
    """Folder of each policy by its name in the report."""
    folders = {"base": paths.BASE}
    for number in range(shape.final_round + 1):
        for cluster in shape.clusters:
            folders[f"expert-{cluster} r{number}"] = paths.expert(number, cluster)
    return folders | {"generalist": paths.GENERALIST}


def curves(shape: Loop) -> Iterator[tuple[str, pd.DataFrame]]:
    """Each policy's learning curve, where it has one."""
    for name, folder in folders_of(shape).items():
        if (folder / "curve.csv").exists():
            yield name, pd.read_csv(folder / "curve.csv")


def learners(shape: Loop) -> Iterator[tuple[str, str]]:
    """Learner of each policy, where its card names one."""
    for name, folder in folders_of(shape).items():
        if (folder / "card.json").exists() and (learner := _json(folder / "card.json").get("learner")):
            yield name, learner


def round_results(turn: Round, clusters: tuple[str, ...]) -> RoundResults:
    """One round's intake, gate, diagnosis, compensation and delta actions."""
    n, plan = turn.n, paths.compensation_plan(turn.n)
    cards = {cluster: paths.delta(n, cluster) / "card.json" for cluster in clusters}
    return RoundResults(
        n=n,
        intake=_json(paths.measured(n) / "summary.json"),
        gate=_json(paths.gate(n)),
        diagnosis=_json(paths.diagnosis_document(n)),
        deltas={cluster: _json(path) for cluster, path in cards.items() if path.exists()},
        parent=turn.parent,
        compensation=_json(plan) if plan.exists() else None,
    )


def picture(results: LoopResults) -> str:
    """The loop with this run's numbers in its boxes."""
    k, labels = results.clusters["k"], results.labels
    kept = len(results.library) - (results.drops["motion"].nunique() if len(results.drops) else 0)
    published = len(results.published.get("models", {}))
    top = [
        Box("motions", f"{len(results.library)} read"),
        Box("filter", f"{kept} kept"),
        Box("cluster", f"K = {k}, {plural(len(labels), 'clip')}"),
        Box("base", trained(results, "base"), "learn"),
        Box("experts", f"{k}, {trained(results, 'expert-', ' r0')}", "learn"),
        Box("distill", "one generalist", "learn"),
        Box("evaluate", plural(len(results.contract["motions"]), "motion")),
        Box("publish", plural(published, "model")),
    ]
    if not results.rounds:
        return loop_picture(top, [], "")
    last = results.rounds[-1]
    effects, kept_deltas = len(last.diagnosis["effects"]), sum(card["promoted"] for card in last.deltas.values())
    bottom = [
        Box("robot", plural(last.intake["accepted"] + last.intake["quarantined"], "rollout"), "robot"),
        Box("ingest", f"{last.intake['quarantined']} set aside"),
        Box("gate", last.gate["status"], "person"),
        Box("diagnose", f"{plural(effects, 'effect')} found"),
        Box("delta", f"{kept_deltas} of {len(last.deltas)} kept", "learn"),
        Box("refine", trained(results, "expert-", f" r{last.n}"), "learn"),
    ]
    return loop_picture(top, bottom, f"{plural(len(results.rounds), 'round')}: measured, explained, refined")


def trained(results: LoopResults, begin: str, end: str = "") -> str:
    """Control steps that each policy whose name begins and ends so was trained on; without a curve it was kept."""
    curves = [curve for name, curve in results.curves.items() if name.startswith(begin) and name.endswith(end)]
    steps = max((int(curve["frames"].max()) for curve in curves), default=0)
    return f"{steps:,} steps" if steps else "kept"


def _json(path: Path) -> dict[str, Any]:
    return json.loads(path.read_text())


def _table(path: Path, columns: tuple[str, ...]) -> pd.DataFrame:
    if not path.exists() or not path.read_text().strip():
        return pd.DataFrame(columns=list(columns))
    return pd.read_csv(path)


if __name__ == "__main__":
    run_stage(main)
