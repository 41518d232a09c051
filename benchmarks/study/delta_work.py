"""Does one step of the comparison of delta actions; started by `benchmarks.study.deltas`.

python -m benchmarks.study.delta_work policy own-c0 --rounds ... --motions ... --robots ... --out ...
"""

import argparse
import tempfile
from collections.abc import Callable
from pathlib import Path

import pandas as pd
import torch

from benchmarks.study.correction import DECLARED, Correction
from benchmarks.study.delta_training import replayed, write_delta
from benchmarks.study.deltas import ARMS, GENERAL, SMALL_DELTAS, DeltasConfig, delta_folder
from benchmarks.study.jobs import Job
from benchmarks.study.motions import read_motions
from benchmarks.study.on_robot import KEY, exported, judged_rows, read_recordings, run_on_robot, write_csv
from benchmarks.study.rounds import BASE, Place, learned_from
from benchmarks.study.settings import SMALL, Study, frozen
from benchmarks.study.steps import GOES_ON
from benchmarks.study.training import deadline, train
from bumblebee.deploy.episodes import Episode
from bumblebee.errors import EXIT_BAD_INPUT, BadInput
from bumblebee.learning.delta import stack
from bumblebee.measured.rollout import Rollout
from bumblebee.sim.sensors import load_model
from tasks.stand_in import cut


class Work:
    """A step's inputs.

    Args:
        options: of the command line.
        study: the study's settings.
        config: of the comparison.
    """

    def __init__(self, options: argparse.Namespace, study: Study, config: DeltasConfig) -> None:
        self.study, self.config, self.out, self.what = study, config, options.out, options.what
        self.motions, self.over = read_motions(options.motions), deadline(options.seconds)
        began = frozen(self.out)
        self.recorded, robot = began["recorded"], began["robot"]
        self.robot = options.robots / f"{robot}.json"
        self.recordings = options.rounds / Place(robot, BASE, 1).name
        self.cluster_of = self.motions.labels.set_index("name")["cluster"]

    def rollouts(self, learned: bool, cluster: str | None) -> list[Rollout]:
        """Recordings to learn from or to judge by, of a cluster's motions or of all."""
        names = learned_from(self.recorded)
        wanted = [own for own in read_recordings(self.recordings) if (own.meta["motion"] in names) == learned]
        return [own for own in wanted if cluster is None or self.cluster_of[own.meta["motion"]] == cluster]

    def pieces(self, cluster: str, split: str) -> list[str]:
        """Names of a cluster's pieces of a split."""
        labels = self.motions.labels
        return labels[(labels["cluster"] == cluster) & (labels["split"] == split)]["name"].tolist()


def delta(work: Work) -> None:
    """A cluster's own delta action, or the general one."""
    cluster = None if work.what == GENERAL else work.what
    rollouts = work.rollouts(True, cluster)
    write_delta(rollouts, work.study.env.engine, work.config.delta, DECLARED, work.out / f"delta-{work.what}")


def errors(work: Work) -> None:
    """A cluster's held-out recordings replayed with each arm's delta action."""
    torch.set_num_threads(1)
    held_out, tables = stack(work.rollouts(False, work.what), load_model()), []
    for arm in ARMS:
        correction = Correction(delta=delta_folder(work.out, arm, work.what))
        for horizon, values in replayed(correction, held_out, work.config.judge_worlds).items():
            about = {"rollout": held_out.ids, "motion": held_out.motions, "arm": arm}
            rows = {**about, "horizon": float(horizon), "error": values}
            tables.append(pd.DataFrame(rows))
    write_csv(work.out / f"errors-{work.what}.csv", pd.concat(tables, ignore_index=True))


def policy(work: Work) -> None:
    """The base policy trained on on a cluster's motions with an arm's delta action; may go on in a later call."""
    arm, cluster = work.what.split("-", 1)
    correction = Correction(delta=delta_folder(work.out, arm, cluster))
    seed, clips = work.study.seeds[0] + 1, tuple(work.pieces(cluster, "train"))
    job = Job(work.what, work.config.steps, seed, BASE, clips)
    if not train(job, work.motions, work.study, work.out, correction, work.over):
        raise SystemExit(GOES_ON)


def tried(work: Work) -> None:
    """A policy on the robot: the cluster's recorded motions and those held out from all training."""
    config, cluster = work.config, work.what.split("-", 1)[1]
    held_out = [name for name in work.pieces(cluster, "test")]
    names = [name for name in work.recorded if work.cluster_of[name] == cluster] + held_out
    by_name = {row.clip.name: row.clip for row in work.motions.rows}
    clips = [cut(by_name[name], config.max_seconds) for name in names]
    episodes = [
        Episode(f"{clip.name}-{run}", KEY, clip.name, config.try_seed + run)
        for clip in clips
        for run in range(config.tries)
    ]
    with tempfile.TemporaryDirectory() as scratch:
        own = exported(work.out / work.what, Path(scratch) / "exported")
        rollouts = run_on_robot(own, work.robot, clips, episodes, config.tried_base, True, 1)
    write_csv(work.out / f"tried-{work.what}.csv", judged_rows(rollouts, clips, held_out))


DO: dict[str, Callable[[Work], None]] = {own.__name__: own for own in (delta, errors, policy, tried)}


def main() -> None:
    """Do one step; exit code 3: not done when the time was over."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("kind", choices=DO)
    parser.add_argument("what")
    parser.add_argument("--rounds", type=Path, required=True)
    parser.add_argument("--motions", type=Path, required=True)
    parser.add_argument("--robots", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--seconds", type=float)
    parser.add_argument("--small", action="store_true")
    options = parser.parse_args()
    settings = (SMALL, SMALL_DELTAS) if options.small else (Study(), DeltasConfig())
    try:
        DO[options.kind](Work(options, *settings))
    except BadInput as error:
        print(error)
        raise SystemExit(EXIT_BAD_INPUT) from None


if __name__ == "__main__":
    main()
