"""Tries the policies of a run on every piece of motion in MuJoCo C at 200 Hz, on the declared robot and on drawn ones.

    python -m benchmarks.study.trying JOB --motions study/motions --out study/experts

is what the study starts for each policy, on one processor core.
"""

import argparse
from pathlib import Path

import pandas as pd
import torch

from benchmarks.baselines.others.follow import follow
from benchmarks.study.jobs import job_of
from benchmarks.study.motions import Motions, read_motions
from benchmarks.study.on_robot import write_csv
from benchmarks.study.others import manner
from bumblebee.errors import EXIT_BAD_INPUT, BadInput
from bumblebee.learning.policy import load_policy
from bumblebee.tracking.config import EnvConfig, Randomisation
from bumblebee.tracking.model import task_model
from bumblebee.tracking.presets import PAPER_RANDOMISATION

TRIALS = "trials.csv"
SEALED_TRIALS = "sealed.csv"
"""Trials on sealed robots, see `sealed_trials`."""
PHYSICS_HZ = 200.0
ROBOTS: dict[str, Randomisation | None] = {"declared": None, "drawn": PAPER_RANDOMISATION}
"""Each piece once on the declared robot, once on a robot of its own of the paper's randomisation, the same for all."""
_AT_ONCE = 64


def try_policy(folder: Path, motions: Motions) -> pd.DataFrame:
    """A row a piece and robot: what `follow` says, and which robot."""
    torch.set_num_threads(1)
    policy, tables = load_policy(folder), []
    how = manner(job_of(folder), policy)
    clips = [row.clip for row in motions.rows]
    for robot, drawn in ROBOTS.items():
        model = task_model(EnvConfig(physics_hz=PHYSICS_HZ, randomisation=drawn or Randomisation()))
        for first in range(0, len(clips), _AT_ONCE):
            part = clips[first : first + _AT_ONCE]
            tables.append(follow(policy, how, part, model, robots=drawn).assign(robot=robot))
    return pd.concat(tables, ignore_index=True)


def write_trials(folder: Path, motions: Motions) -> None:
    """Try the policy and write its trials, whole or not at all."""
    write_csv(folder / TRIALS, try_policy(folder, motions))


def main() -> None:
    """Try one policy of a run."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("job")
    parser.add_argument("--motions", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    options = parser.parse_args()
    try:
        write_trials(options.out / options.job, read_motions(options.motions))
    except BadInput as error:
        print(error)
        raise SystemExit(EXIT_BAD_INPUT) from None


if __name__ == "__main__":
    main()
