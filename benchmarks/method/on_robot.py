"""Recordings of a robot, and what is learned from them: the diagnosis, delta actions, and how much each corrects."""

import tempfile
from collections.abc import Sequence
from pathlib import Path

import mujoco
import pandas as pd
import torch

from benchmarks.method.places import ARMS, TOGETHER, Place, experts
from benchmarks.method.settings import Method
from benchmarks.study.correction import DECLARED, Correction
from benchmarks.study.delta_training import replayed, write_delta
from benchmarks.study.motions import Motions
from benchmarks.study.on_robot import exported, read_recordings, run_policies_on_robot, write_csv
from bumblebee.diagnosis.dataset import open_session
from bumblebee.diagnosis.diagnose import diagnose
from bumblebee.diagnosis.output import fill
from bumblebee.errors import BadInput
from bumblebee.evaluation.thinning import thin
from bumblebee.io.write import new_folder
from bumblebee.learning.delta import stack
from bumblebee.measured.rollout import Rollout, write_rollout
from bumblebee.policy.episodes import Episode
from bumblebee.robot.model import write_xml
from bumblebee.sim.sensors import load_model
from tasks.on_robot.stand_in import cut


def recorded_motions(motions: Motions, most: int) -> dict[str, list[str]]:
    """Names of the training motions of each cluster that are recorded: `most`, or all where there are fewer.

    Raises:
        BadInput: for a cluster of which none would be left to judge by.
    """
    train, found = motions.labels[motions.labels["split"] == "train"], {}
    for cluster in motions.clusters:
        own = train[train["cluster"] == cluster].drop_duplicates("motion")
        found[cluster] = thin(own, most)
        if len(found[cluster]) < 2:
            came = f"{len(found[cluster])}"
            raise BadInput(f"cluster {cluster}", "at least 2 motions to record", came, "Prepare with fewer --clusters.")
    return found


class OnRobot:
    """Recordings and corrections of a run.

    Args:
        method: its settings.
        motions: the study's.
        out: the run's folder.
        robots: folder of the sealed robots.
    """

    def __init__(self, method: Method, motions: Motions, out: Path, robots: Path) -> None:
        self.method, self.motions, self.out, self.robots = method, motions, out, robots
        self.recorded = recorded_motions(motions, method.motions)

    def record(self, name: str, shard: int) -> None:
        """The shard's part of all clusters' motions, each by its cluster's expert that the round starts from."""
        place, method = Place.of(name), self.method
        before = experts(place.before, self.motions.clusters, method.rounds)
        every = [(cluster, motion) for cluster, own in self.recorded.items() for motion in own][shard :: method.shards]
        by_name = {row.clip.name: row.clip for row in self.motions.rows}
        clips = [cut(by_name[motion], method.max_seconds) for _, motion in every]
        seed = method.record_seed + 100 * place.round
        episodes = [
            Episode(f"{motion}-{seed + run}", cluster, motion, seed + run)
            for cluster, motion in every
            for run in range(method.repeats)
        ]
        with tempfile.TemporaryDirectory() as scratch:
            policies = {
                cluster: exported(self.out / policy, Path(scratch) / cluster)
                for cluster, policy in zip(self.motions.clusters, before, strict=True)
            }
            robot = self.robots / f"{place.robot}.json"
            rollouts = run_policies_on_robot(policies, robot, clips, episodes, method.record_base, False, 1)
        with new_folder(self.out / name / f"record-{shard}") as folder:
            _write(folder, rollouts)

    def diagnosis(self, name: str) -> None:
        """Diagnosis of the declared model by the recordings to learn from, of all clusters."""
        mujoco.set_mju_user_warning(lambda text: None)
        torch.set_num_threads(1)
        config = self.method.diagnosis
        with tempfile.TemporaryDirectory() as scratch:
            _write(Path(scratch), self._rollouts(name, True))
            write_xml(Path(scratch) / "model.xml")
            session = open_session(Path(scratch) / "model.xml", Path(scratch), config.thresholds.dataset)
            result = diagnose(session, config, say=lambda text: print(text, flush=True))
            with new_folder(self.out / name / "diagnosis") as folder:
                fill(result, folder)

    def delta(self, name: str) -> None:
        """Delta action of a cluster, or of all together, on what the arm's diagnosis leaves, if it has one."""
        torch.set_num_threads(1)
        place, cluster = Place.of(name), name.rsplit("/", 1)[1]
        found = self.out / place.recorded / "diagnosis" if "diagnosis" in ARMS[place.arm] else None
        rollouts = self._rollouts(place.recorded, True, None if cluster == TOGETHER else cluster)
        write_delta(rollouts, "mujoco", self.method.delta, Correction(found), self.out / name / "delta")

    def errors(self, name: str) -> None:
        """Recordings of the first round to judge by, replayed in each simulator: a row a rollout and horizon."""
        torch.set_num_threads(1)
        robot, tables = name.split("/", 1)[0], []
        found = self.out / name / "diagnosis"
        for cluster in self.motions.clusters:
            held_out = stack(self._rollouts(name, False, cluster), load_model())
            deltas = {arm: self.out / f"{robot}/{arm}/r1/{cluster}/delta" for arm in ("delta", "both")}
            corrections = {
                "declared": DECLARED,
                "general delta": Correction(None, self.out / f"{robot}/delta/r1/{TOGETHER}/delta"),
                "delta": Correction(None, deltas["delta"]),
                "physics": Correction(found),
                "both": Correction(found, deltas["both"]),
            }
            for told, correction in corrections.items():
                for horizon, values in replayed(correction, held_out, self.method.judge_worlds).items():
                    about = {"rollout": held_out.ids, "motion": held_out.motions, "cluster": cluster}
                    rows = {**about, "correction": told, "horizon": float(horizon), "error": values}
                    tables.append(pd.DataFrame(rows))
        write_csv(self.out / name / "errors.csv", pd.concat(tables, ignore_index=True))

    def _rollouts(self, place: str, learned: bool, cluster: str | None = None) -> list[Rollout]:
        """Recordings to learn a correction from, or to judge it by: every second motion of a cluster each."""
        own = self.motions.clusters if cluster is None else [cluster]
        names = {motion for each in own for motion in self.recorded[each][0 if learned else 1 :: 2]}
        return [one for one in read_recordings(self.out / place) if one.meta["motion"] in names]


def _write(folder: Path, rollouts: Sequence[Rollout]) -> None:
    (folder / "rollouts").mkdir()
    for rollout in rollouts:
        write_rollout(folder / "rollouts" / f"{rollout.rollout_id}.parquet", rollout)
