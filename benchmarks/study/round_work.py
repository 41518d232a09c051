"""Does one step of the rounds; started by `benchmarks.study.rounds`.

python -m benchmarks.study.round_work record robot-0/base/r1 --shard 0 --motions ... --robots ... --out ...
"""

import argparse
import json
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

import mujoco
import pandas as pd
import torch

from benchmarks.study.correction import DECLARED, Correction
from benchmarks.study.delta_training import replayed, write_delta
from benchmarks.study.jobs import Job
from benchmarks.study.motions import Motions, read_motions
from benchmarks.study.on_robot import KEY, exported, judged_rows, read_recordings, run_on_robot, write_csv
from benchmarks.study.round_settings import RoundsConfig, add_settings, settings
from benchmarks.study.rounds import ARMS, Place, learned_from
from benchmarks.study.settings import FROZEN, Study
from benchmarks.study.steps import GOES_ON
from benchmarks.study.training import deadline, train
from bumblebee.deploy.episodes import Episode
from bumblebee.diagnosis.dataset import open_session
from bumblebee.diagnosis.diagnose import diagnose
from bumblebee.diagnosis.output import fill
from bumblebee.errors import EXIT_BAD_INPUT, BadInput
from bumblebee.io.write import new_folder
from bumblebee.learning.delta import stack
from bumblebee.measured.rollout import Rollout, write_rollout
from bumblebee.motion.clip import Clip
from bumblebee.robot.model import write_xml
from bumblebee.sim.sensors import load_model
from tasks.stand_in import cut

CORRECTIONS = {"declared": (), "physics": ("diagnosis",), "delta": ("delta",), "both": ("diagnosis", "delta")}
"""Corrections that held-out recordings of round 1 are replayed in."""


class Work:
    """A step's inputs.

    Args:
        options: of the command line.
        study: the study's settings.
        config: the rounds'.
    """

    def __init__(self, options: argparse.Namespace, study: Study, config: RoundsConfig) -> None:
        self.study, self.config, self.out, self.shard = study, config, options.out, options.shard
        self.place = Place.of(options.place)
        self.folder = self.out / self.place.name
        self.robot = options.robots / f"{self.place.robot}.json"
        self.motions: Motions = read_motions(options.motions)
        self.over = deadline(options.seconds)
        self.recorded: list[str] = json.loads((self.out / FROZEN).read_text())["recorded"]

    def clips(self, names: Sequence[str]) -> list[Clip]:
        """Pieces by name, cut to their beginning."""
        by_name = {row.clip.name: row.clip for row in self.motions.rows}
        return [cut(by_name[name], self.config.max_seconds) for name in names]

    def correction(self, parts: Sequence[str], deltas: str) -> Correction:
        """Correction that this round's recordings led to; `deltas` is the arm whose delta action it is."""
        place = self.place
        return Correction(
            self.out / place.recorded.name / "diagnosis" if "diagnosis" in parts else None,
            self.out / Place(place.robot, deltas, place.round).name / "delta" if "delta" in parts else None,
        )

    def rollouts(self, learned: bool) -> list[Rollout]:
        """This round's recordings: to learn a correction from, or to judge it by."""
        names = learned_from(self.recorded)
        folder = self.out / self.place.recorded.name
        return [rollout for rollout in read_recordings(folder) if (rollout.meta["motion"] in names) == learned]

    def on_robot(self, names: Sequence[str], seed: int, repeats: int, base: str, judged: bool) -> list[Rollout]:
        """The shard's part of the motions on the robot; the first tick's seeds differ by repeat."""
        clips = self.clips(list(names)[self.shard :: self.config.shards])
        episodes = [
            Episode(f"{clip.name}-{run}", KEY, clip.name, seed + run) for clip in clips for run in range(repeats)
        ]
        policy = self.place.before if not judged else self.place.policy
        with tempfile.TemporaryDirectory() as scratch:
            own = exported(self.out / policy, Path(scratch) / "exported")
            return run_on_robot(own, self.robot, clips, episodes, base, judged, 1)


def record(work: Work) -> None:
    """The recorded motions with the policy that the round starts from."""
    config = work.config
    seed = config.record_seed + 100 * work.place.round
    rollouts = work.on_robot(work.recorded, seed, config.repeats, config.record_base, False)
    with new_folder(work.folder / f"record-{work.shard}") as folder:
        (folder / "rollouts").mkdir()
        for rollout in rollouts:
            write_rollout(folder / "rollouts" / f"{rollout.rollout_id}.parquet", rollout)


def diagnosis(work: Work) -> None:
    """Diagnose what the declared model lacks, from the recordings to learn from."""
    mujoco.set_mju_user_warning(lambda text: None)
    torch.set_num_threads(1)
    with tempfile.TemporaryDirectory() as scratch:
        dataset = Path(scratch)
        (dataset / "rollouts").mkdir()
        for rollout in work.rollouts(learned=True):
            write_rollout(dataset / "rollouts" / f"{rollout.rollout_id}.parquet", rollout)
        write_xml(dataset / "model.xml")
        config = work.config.diagnosis if work.place.round == 1 else work.config.later
        session = open_session(dataset / "model.xml", dataset, config.thresholds.dataset)
        result = diagnose(session, config, say=lambda text: print(text, flush=True))
        with new_folder(work.folder / "diagnosis") as folder:
            fill(result, folder)


def delta(work: Work) -> None:
    """A delta action on what the arm's diagnosis leaves, if it has one; in one go, on a GPU where PPO learns it."""
    parts = [part for part in ARMS[work.place.arm] if part != "delta"]
    correction, engine = work.correction(parts, work.place.arm), work.study.env.engine
    if work.config.delta.method == "regression":
        torch.set_num_threads(1)
        engine = "mujoco"
    write_delta(work.rollouts(learned=True), engine, work.config.delta, correction, work.folder / "delta")


def errors(work: Work) -> None:
    """Held-out recordings of round 1 replayed in each corrected simulator: a row a rollout, horizon and correction."""
    torch.set_num_threads(1)
    held_out = stack(work.rollouts(learned=False), load_model())
    tables = []
    for name, parts in CORRECTIONS.items():
        found = replayed(work.correction(parts, name), held_out, work.config.judge_worlds)
        for horizon, values in found.items():
            about = {"rollout": held_out.ids, "motion": held_out.motions}
            rows = {**about, "correction": name, "horizon": float(horizon), "error": values}
            tables.append(pd.DataFrame(rows))
    write_csv(work.folder / "errors.csv", pd.concat(tables, ignore_index=True))


def policy(work: Work) -> None:
    """The arm's policy trained on in the simulator as its correction describes the robot; may go on in a later call."""
    place, study = work.place, work.study
    job = Job(place.policy, work.config.steps, study.seeds[0] + place.round, place.before)
    correction = work.correction(ARMS[place.arm], place.arm) if ARMS[place.arm] else DECLARED
    if not train(job, work.motions, study, work.out, correction, work.over):
        raise SystemExit(GOES_ON)


def tried(work: Work) -> None:
    """The round's policy on the robot: recorded motions and those held out from all training."""
    config, labels = work.config, work.motions.labels
    held_out = labels[labels["split"] == "test"].drop_duplicates("motion")["name"].tolist()
    names = [*work.recorded, *held_out]
    rollouts = work.on_robot(names, config.try_seed, config.tries, config.tried_base, True)
    write_csv(work.folder / f"tried-{work.shard}.csv", judged_rows(rollouts, work.clips(names), held_out))


DO: dict[str, Callable[[Work], None]] = {own.__name__: own for own in (record, diagnosis, delta, errors, policy, tried)}


def main() -> None:
    """Do one step; exit code 3: not done when the time was over."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("kind", choices=DO)
    parser.add_argument("place")
    parser.add_argument("--motions", type=Path, required=True)
    parser.add_argument("--robots", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--shard", type=int, default=0)
    parser.add_argument("--seconds", type=float)
    add_settings(parser)
    options = parser.parse_args()
    try:
        DO[options.kind](Work(options, *settings(options)))
    except BadInput as error:
        print(error)
        raise SystemExit(EXIT_BAD_INPUT) from None


if __name__ == "__main__":
    main()
