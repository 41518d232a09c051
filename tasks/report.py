"""Stage report: everything that the loop found, on one page that holds all it needs: reports/report.html."""

import json
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pandas as pd

from bumblebee.measured.rollout import Rollout, read_rollout
from bumblebee.motion.store import read_index
from bumblebee.ranges import Line, Name, Ranged, Seed
from bumblebee.report.data_sections import clusters_section, motions_section
from bumblebee.report.filmstrip import film
from bumblebee.report.loop_picture import Box, loop_picture
from bumblebee.report.page import Block, Section, note, render, still, text
from bumblebee.report.page import film as film_block
from bumblebee.report.policy_sections import registry_section, success_section, training_section
from bumblebee.report.results import LoopResults, RoundResults
from bumblebee.report.round_sections import round_section
from bumblebee.report.verdict import facts, verdict
from bumblebee.report.wording import plural
from bumblebee.robot.model import build_spec
from tasks.lineage import git_sha
from tasks.rollouts import FILTERED, SEALED, RolloutsConfig, start_stand_in
from tasks.sections import Loop, loop
from tasks.stage import load, log_run, output_file, run_stage

OUT = Path("reports/report.html")


@dataclass(frozen=True)
class ReportConfig(Ranged):
    """What the page shows beside the numbers."""

    title: Name = "BumbleBee: from motions to a registered generalist"
    """The page's heading."""
    film: bool = True
    """Run the generalist once more on the stand-in robot and show it."""
    film_motion: Line = ""
    """Motion of the film; empty: the liveliest one that it follows."""
    seed: Seed = 3
    """Of the film's start state and sensor noise."""


def main() -> None:
    """Write the page."""
    config, shape = load("report", ReportConfig), loop()
    results = collect(shape)
    sections = [motions_section(results), clusters_section(results), training_section(results)]
    sections += [round_section(results, turn) for turn in results.rounds]
    sections.append(success_section(results))
    if config.film and not results.real_robot:
        sections.append(film_section(config))
    sections.append(registry_section(results))
    when = datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")
    subtitle = f"{when} · code {git_sha()[:12]} · evaluation contract {results.evaluation['contract_sha256'][:12]}"
    page = render(config.title, subtitle, verdict(results), picture(results), sections, facts(results))
    with output_file(OUT) as file:
        file.write_text(page)
    print(f"report: {OUT} ({OUT.stat().st_size / 1e6:.1f} MB)")
    for line in verdict(results):
        print(f"  {line}")
    log_run("report", params=config, artifacts=[OUT])


def collect(shape: Loop) -> LoopResults:
    """Read what the stages left."""
    library = read_index(Path("data/motions"))
    return LoopResults(
        library=library,
        skipped=_table(Path("data/motions/skipped.csv"), ("file", "reason")),
        drops=_table(Path("data/filtered/drops.csv"), ("motion", "rule", "explanation")),
        labels=pd.read_parquet("data/clusters/labels.parquet"),
        elbow=pd.read_csv("data/clusters/elbow.csv"),
        clusters=_json(Path("data/clusters/summary.json")),
        curves=dict(curves(shape)),
        evaluation=_json(Path("data/evaluation/summary.json")),
        contract=_json(Path("data/evaluation/contract.json")),
        published=_json(Path("data/published.json")),
        sealed=sealed_truth(),
        rounds=tuple(round_results(turn.n, shape.clusters) for turn in shape.rounds if turn.n <= shape.final_round),
        pretrained=_json(Path("models/base/card.json")).get("parent") == "pretrained",
    )


def sealed_truth() -> dict[str, Any] | None:
    """What was sealed in the stand-in; None where the measured rollouts are of the user's robot."""
    return _json(SEALED) if load("rollouts", RolloutsConfig).source is None else None


def curves(shape: Loop) -> Iterator[tuple[str, pd.DataFrame]]:
    """Each policy's learning curve, where it has one."""
    folders = {"base": Path("models/base")}
    for number in range(shape.final_round + 1):
        for cluster in shape.clusters:
            folders[f"expert-{cluster} r{number}"] = Path(f"models/experts/r{number}/{cluster}")
    folders["generalist"] = Path("models/generalist")
    for name, folder in folders.items():
        if (folder / "curve.csv").exists():
            yield name, pd.read_csv(folder / "curve.csv")


def round_results(n: int, clusters: tuple[str, ...]) -> RoundResults:
    """One round's intake, gate, diagnosis and delta actions."""
    cards = {cluster: Path(f"models/delta/r{n}/{cluster}/card.json") for cluster in clusters}
    return RoundResults(
        n=n,
        intake=_json(Path(f"data/measured/r{n}/summary.json")),
        gate=_json(Path(f"data/gates/round-{n}.json")),
        diagnosis=_json(Path(f"data/diagnosis/r{n}/diagnosis.json")),
        deltas={cluster: _json(path) for cluster, path in cards.items() if path.exists()},
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
        Box("base", "one policy for all", "learn"),
        Box("experts", f"{k}, one a cluster", "learn"),
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
        Box("refine", "corrected model", "learn"),
    ]
    return loop_picture(top, bottom, f"{plural(len(results.rounds), 'round')}: measured, explained, refined")


def film_section(config: ReportConfig) -> Section:
    """The generalist on the stand-in robot, once more, in pictures."""
    motion, why = chosen_motion(config)
    rollout = run_once(motion, config.seed)
    spec = build_spec()
    spec.compile()
    shown = film(rollout, spec.to_xml())
    blocks: list[Block] = [
        text(
            f"'{motion}' on the stand-in robot: {why}. The film is one more episode, with its own start and sensor "
            "noise, so it may end otherwise than those that were counted."
        )
    ]
    if shown.sheet is not None:
        caption = "Measured joint angles and base pose, drawn off-screen, at real speed. Arrow keys step on the slider."
        blocks.append(film_block(shown.sheet, f"Film of '{motion}'", caption, f"The robot during '{motion}'."))
    blocks += [still(uri, f"{at:.1f} s", f"The robot {at:.1f} s after the start.") for at, uri in shown.stills]
    return Section("film", "Film", (*blocks, note(shown.note)))


def chosen_motion(config: ReportConfig) -> tuple[str, str]:
    """The motion asked for; else the liveliest that the generalist followed on the robot, else the longest followed."""
    if config.film_motion:
        return config.film_motion, "the motion that was asked for"
    episodes = pd.read_parquet("data/evaluation/episodes.parquet")
    own = episodes[(episodes["policy"] == "generalist") & (episodes["engine"] == "stand_in")]
    speed = pd.read_csv("data/clusters/statistics.csv").set_index("name")["speed"]
    own = own.assign(speed=own["motion"].map(speed).fillna(0.0))
    good = own[own["success"]]
    if len(good):
        return str(
            good.sort_values("speed").iloc[-1]["motion"]
        ), "the fastest motion that the generalist followed to the end in the evaluation"
    return str(
        own.sort_values("frames").iloc[-1]["motion"]
    ), "the motion that the generalist followed longest in the evaluation, though not to the end"


def run_once(motion: str, seed: int) -> Rollout:
    """One rollout of the generalist on the stand-in robot."""
    episode = {"rollout_id": "film", "policy": "generalist", "motion": motion, "seed": seed}
    plan: dict[str, Any] = {"policies": {"generalist": str(Path("models/generalist").resolve())}, "episodes": [episode]}
    with tempfile.TemporaryDirectory() as folder:
        start_stand_in(plan, FILTERED, Path(folder) / "rollouts", Path(folder), threads=1)
        return read_rollout(Path(folder) / "rollouts" / "film.parquet")


def _json(path: Path) -> dict[str, Any]:
    return json.loads(path.read_text())


def _table(path: Path, columns: tuple[str, ...]) -> pd.DataFrame:
    if not path.exists() or not path.read_text().strip():
        return pd.DataFrame(columns=list(columns))
    return pd.read_csv(path)


if __name__ == "__main__":
    run_stage(main)
