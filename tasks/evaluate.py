"""Stage evaluate: every policy on the nominal model and on the stand-in robot, under one frozen contract.

Writes data/evaluation/contract.json, episodes.parquet (one row an episode) and summary.json (results and comparisons).
"""

import json
import re
import tempfile
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from hashlib import sha256
from pathlib import Path
from typing import Annotated, Any

import pandas as pd

from bumblebee.errors import BadInput
from bumblebee.evaluation.contract import (
    Contract,
    StartNoise,
    freeze,
    read_contract,
    require_same,
    write_contract,
)
from bumblebee.evaluation.engines import engine_settings
from bumblebee.evaluation.episodes import rollout_metrics
from bumblebee.evaluation.summary import COLUMNS, comparisons, results, unchanged_pairs
from bumblebee.evaluation.thinning import thin
from bumblebee.measured.rollout import Rollout, read_rollout
from bumblebee.motion.clip import Clip
from bumblebee.motion.store import read_index, read_library, write_library
from bumblebee.policy.episodes import FALL_RULE, Episode, run_episodes
from bumblebee.policy.exported import ExportedPolicy
from bumblebee.policy.robots import NominalRobots
from bumblebee.progress import progress
from bumblebee.ranges import Count, Few, Line, Name, Range, Ranged, Seed, Size
from bumblebee.robot.sensors import NO_NOISE, SensorNoise
from bumblebee.stand_in.body import StandInRobots
from tasks.on_robot.stand_in import cut, start_stand_in
from tasks.policies.candidates import Candidate, candidates, chain, same
from tasks.running import paths
from tasks.running.stage import load, log_run, output_folder, run_stage
from tasks.settings.params import FILE

ENGINES = ("nominal", "stand_in")


@dataclass(frozen=True)
class EvaluateConfig(Ranged):
    """Settings of the evaluation."""

    seeds: Annotated[tuple[Seed, ...], Size()] = (0,)
    """One episode for each seed, motion and policy."""
    engines: Annotated[tuple[Name, ...], Size()] = ("nominal", "stand_in")
    """Which robots: the declared model, the stand-in."""
    max_seconds: Annotated[float, Range(least=0.1, most=3600)] = 10.0
    """Longer motions are cut to their beginning [s]."""
    max_motions: Count = 40
    """A larger library is thinned: held-out motions first, at least one of each cluster, the rest evenly."""
    untrained: bool = True
    """Also a policy with fresh weights: what there is before training."""
    contract: Line = ""
    """sha256 of the contract that must be met, or nothing; a different one is refused."""
    threads: Few = 2
    """CPU threads of the simulation."""
    start_noise: StartNoise = field(default_factory=StartNoise)
    """Noise of the start states."""

    def __post_init__(self) -> None:
        """Refuse robots that there are not, and episodes that would be run twice."""
        super().__post_init__()
        self.require_names("engines", ENGINES)
        self.require(len(set(self.seeds)) == len(self.seeds), "seeds", "distinct numbers")
        digest = not self.contract or bool(re.fullmatch("[0-9a-f]{64}", self.contract))
        self.require(digest, "contract", "nothing, or a sha256 of 64 digits")


def main() -> None:
    """Evaluate every policy there is."""
    config = load("evaluate", EvaluateConfig)
    clips, cluster_of = motions(config)
    contract = frozen(clips, config)
    print(f"evaluation contract {contract.sha256}: {len(clips)} motions, seeds {list(config.seeds)}", flush=True)
    with tempfile.TemporaryDirectory() as scratch:
        found, missing = candidates(Path(scratch), config.untrained)
        for name in missing:
            print(f"not evaluated, no such policy: {name}", flush=True)
        planned = plan(found, clips, cluster_of, config.seeds)
        tables = [
            run(engine, found, planned, clips, contract, cluster_of, config, Path(scratch)) for engine in config.engines
        ]
        pairs = chain(found)
        same_pairs = unchanged_pairs({c.policy: " ".join(same(c)) for c in found}, pairs)
    episodes = pd.concat(tables, ignore_index=True)
    summary = {
        "schema": 1,
        "contract_sha256": contract.sha256,
        "policies": [c.told() for c in found],
        "missing": missing,
        "results": results(episodes),
        "comparisons": [c | {"unchanged": (c["from"], c["to"]) in same_pairs} for c in comparisons(episodes, pairs)],
    }
    with output_folder(paths.EVALUATION) as folder:
        write_contract(folder / "contract.json", contract)
        episodes.to_parquet(folder / "episodes.parquet", index=False)
        (folder / "summary.json").write_text(json.dumps(summary, indent=1, allow_nan=False) + "\n")
    tell(summary)
    tags = {"evaluation_contract": contract.sha256}
    log_run("evaluate", params=config, metrics=headline(summary), tags=tags)


def motions(config: EvaluateConfig) -> tuple[list[Clip], dict[str, str]]:
    """The kept clips, thinned and cut, and the cluster of each."""
    labels = pd.read_parquet(paths.LABELS)
    cluster_of = dict(zip(labels["name"], labels["cluster"], strict=True))
    index = read_index(paths.FILTERED)
    names = thin(index.assign(cluster=index["name"].map(cluster_of).fillna("")), config.max_motions)
    return [cut(clip, config.max_seconds) for clip in read_library(paths.FILTERED, names)], cluster_of


def frozen(clips: list[Clip], config: EvaluateConfig) -> Contract:
    """The contract; one that is not the wanted one is refused, with what differs if the old one is still there."""
    engines = {name: settings(name) for name in config.engines}
    contract = freeze(clips, config.seeds, config.start_noise, engines, FALL_RULE)
    if config.contract and config.contract != contract.sha256:
        if (paths.EVALUATION / "contract.json").exists():
            require_same(
                read_contract(paths.EVALUATION / "contract.json"), contract.as_dict(), f"{FILE}: evaluate.contract"
            )
        raise BadInput(
            f"{FILE}: evaluate.contract",
            config.contract[:12],
            contract.sha256[:12],
            "Motions or settings have changed.",
        )
    return contract


def settings(engine: str) -> dict[str, Any]:
    """Settings of an engine in the contract, from the model that it runs; of the sealed robot only the file's hash."""
    if engine == "nominal":
        return {**engine_settings(NominalRobots(1, 1).model), "sensor_noise": None}
    if not paths.SEALED_ROBOT.exists():
        raise BadInput(paths.SEALED_ROBOT, "the sealed robot", "no such file", "Run the stage seal.")
    told = {
        "sensor_noise": asdict(SensorNoise()),
        "judged_by": "true state",
        "sealed_file_sha256": sha256(paths.SEALED_ROBOT.read_bytes()).hexdigest(),
    }
    return {**engine_settings(StandInRobots(1, []).model), **told}


def plan(
    found: list[Candidate], clips: list[Clip], cluster_of: dict[str, str], seeds: tuple[int, ...]
) -> list[Episode]:
    """Each policy on each of its clips with each seed."""
    return [
        Episode(f"{c.policy}-{clip.name}-{seed}", c.policy, clip.name, seed)
        for c in found
        for clip in clips
        if c.cluster is None or cluster_of.get(clip.name) == c.cluster
        for seed in seeds
    ]


def run(
    engine: str,
    found: list[Candidate],
    planned: list[Episode],
    clips: list[Clip],
    contract: Contract,
    cluster_of: dict[str, str],
    config: EvaluateConfig,
    scratch: Path,
) -> pd.DataFrame:
    """All episodes on one engine, one row each; what would be the same episode is run once."""
    about = {c.policy: c for c in found if engine == "stand_in" or not c.for_robot_only}
    own = [episode for episode in planned if episode.policy in about]
    first = {same(c): c for c in reversed(about.values())}
    twin = {c.policy: first[same(c)].policy for c in about.values()}
    once = {(twin[e.policy], e.motion, e.seed): e for e in own}
    by_name, runs = {clip.name: clip for clip in clips}, list(once.values())
    rollouts = (nominal if engine == "nominal" else stand_in)(list(about.values()), runs, by_name, config, scratch)
    thresholds = {motion["name"]: motion["threshold_m"] for motion in contract.motions}
    results = {
        key: asdict(rollout_metrics(rollout, by_name[key[1]], thresholds[key[1]]))
        for key, rollout in zip(once, rollouts, strict=True)
    }
    rows = []
    for episode in own:
        clip, policy = by_name[episode.motion], about[episode.policy]
        rows.append(
            {
                **{"policy": policy.policy, "kind": policy.kind, "round": policy.round, "motion": clip.name},
                **{"cluster": cluster_of.get(clip.name, ""), "family": clip.family, "split": clip.split},
                **{"engine": engine, "seed": episode.seed},
                **results[twin[episode.policy], episode.motion, episode.seed],
            }
        )
    return pd.DataFrame(rows)[list(COLUMNS)].astype({"round": "Int64"})


def nominal(
    found: list[Candidate], planned: list[Episode], clips: dict[str, Clip], config: EvaluateConfig, scratch: Path
) -> list[Rollout]:
    """On the declared model, in this process, without sensor noise."""
    loaded = {c.policy: ExportedPolicy.load(c.folder) for c in found}
    total = sum(clips[e.motion].frames for e in planned)
    with progress(total, f"nominal model, {len(planned)} episodes", "ticks") as bar:
        return run_episodes(
            lambda n: NominalRobots(n, config.threads), planned, loaded, clips, NO_NOISE, config.start_noise, bar.update
        )


def stand_in(
    found: list[Candidate], planned: list[Episode], clips: dict[str, Clip], config: EvaluateConfig, scratch: Path
) -> Iterator[Rollout]:
    """On the stand-in robot, a process of its own, through measured rollouts."""
    write_library(scratch / "clips", list(clips.values()))
    episodes = [{"rollout_id": e.rollout_id, "policy": e.policy, "motion": e.motion, "seed": e.seed} for e in planned]
    work = {
        "policies": {c.policy: str(c.folder.resolve()) for c in found},
        "compensations": {c.policy: str(c.compensation.resolve()) for c in found if c.compensation},
        "episodes": episodes,
        "start_noise": asdict(config.start_noise),
        "judged": True,
    }
    start_stand_in(work, scratch / "clips", scratch / "rollouts", scratch, config.threads)
    return (read_rollout(scratch / "rollouts" / f"{e.rollout_id}.parquet") for e in planned)


def headline(summary: dict) -> dict[str, dict[int, float]]:
    """Success rates over all motions, by engine and policy, over the rounds, for MLflow."""
    rates: dict[str, dict[int, float]] = {}
    for r in summary["results"]:
        if r["split"] == r["group"] == "all":
            name = r["policy"].replace(f"-r{r['round']}", "")
            rates.setdefault(f"{r['engine']}/{name}/success", {})[r["round"] or 0] = r["success"]["value"]
    return rates


def tell(summary: dict) -> None:
    """Print the summary as a table on the terminal."""
    print(f"{'policy':<28}{'engine':<10}{'success [95 %]':<24}{'MPJPE rad':>10}{'MPKPE mm':>10}")
    for r in summary["results"]:
        if r["split"] == r["group"] == "all":
            low, high = r["success"]["ci95"]
            rate = f"{r['success']['value']:.0%} [{low:.0%}, {high:.0%}] of {r['n']}"
            print(
                f"{r['policy']:<28}{r['engine']:<10}{rate:<24}{r['mpjpe_rad']['value']:>10.3f}{r['mpkpe_mm']['value']:>10.0f}"
            )


if __name__ == "__main__":
    run_stage(main)
