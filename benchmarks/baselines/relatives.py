"""How well a policy follows relatives of the motions that it has learned from: what it has learned beside them.

    python -m benchmarks.baselines.relatives FOLDER... --motions motions.npz --out relatives.csv

tries them on the robot as it is; with `--robots light` or `paper` each motion's robot is drawn from that randomisation.

Held-out motions are few; every motion has relatives, which a training has not seen unless it was told to, and whose
difficulty is much the same: its reflection, itself with the arms of another one, itself at 1.1 of its tempo (flights
keep theirs). A policy that follows a motion and loses its reflection has learned the motion and not the task.
"""

import argparse
import multiprocessing
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import torch

from benchmarks.baselines.methods import RANDOMISATIONS
from benchmarks.baselines.others.follow import follow
from benchmarks.baselines.trial import PHYSICS_HZ, rate
from benchmarks.baselines.variety import another, at_tempo, flies, with_arms
from benchmarks.motion_pack import read_pack, whole_motions
from bumblebee.errors import EXIT_BAD_INPUT, BadInput
from bumblebee.evaluation.intervals import success_rate
from bumblebee.learning.policy import load_policy
from bumblebee.learning.rollout import Manner
from bumblebee.motion.clip import Clip
from bumblebee.tracking.config import EnvConfig
from bumblebee.tracking.model import task_model
from bumblebee.tracking.sampling.reflection import reflected

FASTER = 1.1


def _armed(clips: Sequence[Clip]) -> list[Clip]:
    generator = np.random.default_rng(5)
    count = len(clips)
    return [with_arms(c, clips[another(i, count, generator)], generator.random()) for i, c in enumerate(clips)]


RELATIVES: dict[str, Callable[[Sequence[Clip]], list[Clip]]] = {
    "itself": list,
    "mirrored": lambda clips: [replace(reflected(clip), name=clip.name) for clip in clips],
    "other arms": _armed,
    "faster": lambda clips: [clip if flies(clip) else at_tempo(clip, FASTER) for clip in clips],
}
"""By name: the relatives of clips, one of each."""


def try_relatives(folder: Path, motions: Path, kind: str, robots: str = "none") -> pd.DataFrame:
    """Roll the policy in `folder` out on relatives of one kind of all whole real motions; a row each.

    Each motion's robot is drawn from the randomisation of that name.
    """
    torch.set_num_threads(1)
    rows = [row for row in whole_motions(read_pack(motions)) if row.group != "embedded"]
    policy = load_policy(folder)
    clips = RELATIVES[kind]([row.clip for row in rows])
    drawn = RANDOMISATIONS[robots]
    model = task_model(EnvConfig(physics_hz=PHYSICS_HZ, randomisation=drawn))
    table = follow(policy, Manner(policy.shape.seen), clips, model, robots=drawn)
    return table.assign(policy=Path(folder).name, kind=kind)


def table_of(trials: pd.DataFrame) -> str:
    """Markdown: success by key bodies and by the pelvis rule, with 95 % intervals over motions.

    A row for each policy, a column for each kind and split.
    """
    kinds = [(kind, split) for kind in dict.fromkeys(trials["kind"]) for split in ("train", "test")]
    lines = ["| policy | " + " | ".join(f"{kind}, {split}" for kind, split in kinds) + " |"]
    lines.append("|" + "---|" * (len(kinds) + 1))
    for policy, own in trials.groupby("policy", sort=False):
        cells = []
        for kind, split in kinds:
            rows = own[(own["kind"] == kind) & (own["split"] == split)]
            cells.append(_cell(rows))
        lines.append(f"| {policy} | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def _cell(rows: pd.DataFrame) -> str:
    if rows.empty:
        return "-"
    names = rows["name"].to_numpy()
    both = (rows[rule].to_numpy(dtype=bool) for rule in ("success", "success_upright"))
    key, pelvis = (f"{int(done.sum())} of {len(done)}, {rate(success_rate(done, names).as_dict())}" for done in both)
    return f"{key}; pelvis rule {pelvis}"


def main() -> None:
    """Try the policies, each kind of relatives in a process; bad input is one line and status 2."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folders", nargs="+", type=Path, help="each with policy.pt, of this repository's own task")
    parser.add_argument("--motions", type=Path, required=True, help="file of benchmarks.motion_pack")
    parser.add_argument("--out", type=Path, required=True, help="CSV file, a row a rollout")
    parser.add_argument("--kinds", nargs="*", choices=RELATIVES, default=list(RELATIVES))
    parser.add_argument("--robots", choices=RANDOMISATIONS, default="none", help="randomisation of the robots")
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    options = parser.parse_args()
    try:
        work = [(folder, options.motions, kind, options.robots) for folder in options.folders for kind in options.kinds]
        for folder in options.folders:
            load_policy(folder)
        if options.jobs == 1:
            tables = [try_relatives(*each) for each in work]
        else:
            with multiprocessing.get_context("spawn").Pool(options.jobs) as pool:
                tables = pool.starmap(try_relatives, work, chunksize=1)
    except BadInput as error:
        print(error)
        raise SystemExit(EXIT_BAD_INPUT) from None
    trials = pd.concat(tables, ignore_index=True)
    options.out.parent.mkdir(parents=True, exist_ok=True)
    trials.to_csv(options.out, index=False)
    print(table_of(trials), end="")


if __name__ == "__main__":
    main()
