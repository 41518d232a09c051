"""Stage rollouts: one cluster's expert runs on the robot for one round and measured rollouts come back.

The robot is the stand-in, a process of its own, or, where `rollouts.source` names a folder, the user's: its files
`<source>/r<N>/<cluster>/[rollouts/]*.parquet` are copied, the originals stay as they are. The folder says the cluster:
the copy of a file that names none names it, a file that names another is refused.
"""

import shutil
import tempfile
from pathlib import Path

import numpy as np
import pandas as pd

from bumblebee.errors import BadInput
from bumblebee.evaluation.episodes import rollout_metrics
from bumblebee.measured.rollout import copy_of_cluster
from bumblebee.motion.clip import Clip
from bumblebee.motion.store import read_index, read_library, write_library
from bumblebee.policy.episodes import Episode, run_episodes
from bumblebee.policy.exported import ExportedPolicy
from bumblebee.policy.robots import NominalRobots
from bumblebee.robot.model import write_xml
from bumblebee.robot.sensors import NO_NOISE
from bumblebee.tracking.terminations import success_threshold
from tasks.on_robot.stand_in import DIRECT, cut, start_stand_in
from tasks.running import paths
from tasks.running.stage import load, log_run, output_folder, run_stage
from tasks.sections import parent_of
from tasks.settings.rollouts_config import RolloutsConfig

OVER_WIRE = ["-m", "bumblebee.wire.robot_end.stand_in"]
"""Process of the robot behind guard and wire."""


def main(round: int, cluster: str) -> None:
    """Fill data/rollouts/r<round>/<cluster>."""
    config = load("rollouts", RolloutsConfig)
    target = paths.rollouts(round, cluster)
    with output_folder(target) as folder:
        if config.source is not None:
            copy_users(config.source / f"r{round}" / cluster, folder)
        else:
            policy = paths.expert(parent_of(round), cluster)
            clips = draw(candidates(cluster, config.max_seconds), config, round, cluster)
            chosen = choose(policy, clips, config)
            chosen.to_csv(folder / "chosen.csv", index=False)
            run_names = set(chosen["motion"][chosen["run"]])
            run_stand_in(policy, cluster, [clip for clip in clips if clip.name in run_names], folder, config, round)
        if not (folder / "model.xml").exists():
            write_xml(folder / "model.xml")
        count = len(list((folder / "rollouts").glob("*.parquet")))
    print(f"round {round}, {cluster}: {count} measured rollouts in {target}")
    log_run("rollouts", cluster=cluster, round=round, params=config, metrics={"rollouts": count})


def draw(clips: list[Clip], config: RolloutsConfig, round: int, cluster: str) -> list[Clip]:
    """The clips in a drawn order, another in every round; no more than four times those that are run."""
    rng = np.random.default_rng([config.seed, round, *cluster.encode()])
    return [clips[i] for i in rng.permutation(len(clips))[: 4 * config.motions]]


def choose(policy: Path, clips: list[Clip], config: RolloutsConfig) -> pd.DataFrame:
    """Which of the drawn clips are run: the first that the policy follows to their end in the nominal simulation.

    Where it follows fewer than wanted, those that it followed longest fill up: they give data until the fall. Columns:
    motion, family, success, frames (before termination), share (of the clip), mpkpe_mm, run.
    """
    table = followed(policy, clips, config.threads)
    # Stable: the draw decides among those that succeed, the share that was followed among those that do not.
    table = table.sort_values("share", ascending=False, kind="stable").reset_index(drop=True)
    table["run"] = np.arange(len(table)) < config.motions
    return table


def followed(policy: Path, clips: list[Clip], threads: int) -> pd.DataFrame:
    """How far the policy follows each clip in the declared model, without noise."""
    episodes = [Episode(clip.name, "expert", clip.name, 0) for clip in clips]
    by_name = {clip.name: clip for clip in clips}
    rollouts = run_episodes(
        lambda n: NominalRobots(n, threads), episodes, {"expert": ExportedPolicy.load(policy)}, by_name, NO_NOISE
    )
    rows = []
    for clip, rollout in zip(clips, rollouts, strict=True):
        result = rollout_metrics(rollout, clip, success_threshold(clip))
        share = 1.0 if result.success else result.frames / clip.frames
        rows.append((clip.name, clip.family, result.success, result.frames, share, result.mpkpe_mm))
    return pd.DataFrame(rows, columns=["motion", "family", "success", "frames", "share", "mpkpe_mm"])


def candidates(cluster: str, max_seconds: float) -> list[Clip]:
    """Kept clips of the cluster that were trained on, cut to their beginning where they are longer."""
    labels = pd.read_parquet(paths.LABELS)
    index = read_index(paths.FILTERED)
    usable = set(index["name"][index["split"] == "train"])
    names = [name for name in labels["name"][labels["cluster"] == cluster] if name in usable]
    if not names:
        raise BadInput(paths.LABELS, f"motions of {cluster} in the train split", "none")
    return [cut(clip, max_seconds) for clip in read_library(paths.FILTERED, names)]


def run_stand_in(
    policy: Path, cluster: str, clips: list[Clip], folder: Path, config: RolloutsConfig, round: int
) -> None:
    """Start the stand-in as its own process and wait; its one line of complaint becomes ours."""
    name, parent = f"expert-{cluster}", parent_of(round)
    used = {"name": name, "version": f"r{parent}", "sha256": ExportedPolicy.load(policy).sha256}
    episodes = [
        {
            "rollout_id": f"r{round}-{cluster}-{clip.name}-{run}",
            "policy": name,
            "motion": clip.name,
            "seed": config.seed + 1000 * round + run,
            "meta": {"cluster": cluster, "policy": used},
        }
        for clip in clips
        for run in range(config.repeats)
    ]
    stop = {"tilt_deg": config.stop_tilt, "drop_m": config.stop_drop}
    plan = {"policies": {name: str(policy.resolve())}, "episodes": episodes, "base": config.base, "stop": stop}
    with tempfile.TemporaryDirectory() as scratch:
        write_library(Path(scratch) / "clips", clips)
        out, work, module = folder / "rollouts", Path(scratch), DIRECT if config.wire == "none" else OVER_WIRE
        start_stand_in(plan, work / "clips", out, work, config.threads, module=module)


def copy_users(source: Path, folder: Path) -> None:
    """Copy the user's rollouts and model, each rollout with the cluster whose folder it is in; originals stay as is."""
    inner = source / "rollouts" if (source / "rollouts").is_dir() else source
    files = sorted(inner.glob("*.parquet")) if inner.is_dir() else []
    if not files:
        raise BadInput(
            f"params.yaml: rollouts.source: {source}", "a folder with *.parquet of this round and cluster", "none"
        )
    (folder / "rollouts").mkdir()
    for file in files:
        copy_of_cluster(file, folder / "rollouts" / file.name, source.name)
    if (source / "model.xml").is_file():
        shutil.copy2(source / "model.xml", folder / "model.xml")


if __name__ == "__main__":
    run_stage(main)
