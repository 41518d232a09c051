"""From the paper's printed reward table to one that teaches, a change at a time.

    python -m benchmarks.study.reward_ladder --out ladder --steps 1.8e6        # again goes on; prints the table

Our own task on the embedded motions, from nothing, equal steps, one core; only the reward (and, where it says so, the
actions' first deviation) differs. Beside what was learnt stands what the reference itself earns under the whole table
(`benchmarks.study.printed_rewards`).
"""

import argparse
import math
from dataclasses import replace
from pathlib import Path

import pandas as pd
import torch

from benchmarks.baselines.others.follow import follow
from benchmarks.motion_pack import EMBEDDED_SHARE
from benchmarks.study.printed_rewards import earned, on_reference
from benchmarks.study.reward_arms import Arm, arms
from bumblebee.errors import EXIT_BAD_INPUT, BadInput
from bumblebee.evaluation.intervals import Estimate, mean_by_motion, wilson
from bumblebee.learning.config import PpoConfig
from bumblebee.learning.learner import CURVE
from bumblebee.learning.policy import load_policy
from bumblebee.learning.ppo.learner import Trainer
from bumblebee.learning.rollout import Manner
from bumblebee.motion.clip import Clip
from bumblebee.motion.embedded import make_library
from bumblebee.motion.filters.rules import filter_clips
from bumblebee.motion.pieces import hold_out
from bumblebee.sim.engine_choice import make_engine
from bumblebee.tracking.config import EnvConfig
from bumblebee.tracking.env import TrackingEnv
from bumblebee.tracking.model import task_model
from bumblebee.tracking.sampling.library import MotionLibrary

TRIALS = "trials.csv"


def train(folder: Path, arm: Arm, clips: list[Clip], steps: float, seed: int) -> None:
    """Train into `folder`, or go on."""
    task = EnvConfig(threads=1, reward=arm.rewards)
    engine = make_engine(task.engine, task_model(task), task.num_worlds, 1)
    env = TrackingEnv(MotionLibrary(clips, task.ahead), engine, task, seed=seed)
    ppo = replace(PpoConfig(), initial_std=arm.std)
    ppo = replace(ppo, iterations=math.ceil(steps / (task.num_worlds * ppo.steps)))
    trainer = Trainer(env, ppo, folder, seed, None)
    trainer.train(folder.name)
    trainer.policy().save(folder)


def worth(arm: Arm, clips: list[Clip]) -> tuple[Estimate, float]:
    """Reward of a second of the reference itself under the whole table, mean over clips; share of clips below 0."""
    library = MotionLibrary(clips, ())
    engine = make_engine("mujoco", task_model(EnvConfig()), len(clips), 1)
    rows = earned(clips, library, engine, on_reference, arm.rewards)
    total = rows.drop(columns=["name", "frames"]).sum(axis=1).to_numpy()
    return mean_by_motion(total, rows["name"].to_numpy()), float((total < 0).mean())


def table(out: Path, clips: list[Clip]) -> str:
    """All arms that are done, as Markdown."""
    titles = [
        "reward",
        "the reference earns a second",
        "share below 0",
        "training's end: reward a second",
        "episode [s]",
        "deviation",
    ]
    lines = [*titles, "motions followed, trained", "held out"]
    rows = ["| " + " | ".join(lines) + " |", "|" + "---|" * len(lines)]
    for name, arm in arms().items():
        if not (out / name / TRIALS).exists():
            continue
        total, below = worth(arm, clips)
        last = pd.read_csv(out / name / CURVE).tail(10).mean()
        trials = pd.read_csv(out / name / TRIALS)
        cells = [arm.told, f"{total.value:+.2f} [{total.low:+.2f}, {total.high:+.2f}]", f"{below:.2f}"]
        cells += [f"{50 * last['reward']:+.2f}", f"{0.02 * last['episode_length']:.1f}", f"{last['action_std']:.2f}"]
        for split in ("train", "test"):
            own = trials[trials["split"] == split]["success"]
            low, high = wilson(float(own.sum()), len(own))
            cells.append(f"{own.mean():.2f} [{low:.2f}, {high:.2f}] of {len(own)}")
        rows.append("| " + " | ".join(cells) + " |")
    return "\n".join(rows) + "\n"


def main() -> None:
    """Train and try each arm that is not done; print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--steps", type=float, default=1.8e6, help="control steps of each arm")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", nargs="*", choices=list(arms()), default=list(arms()))
    options = parser.parse_args()
    torch.set_num_threads(1)
    clips = hold_out(filter_clips(make_library())[0], EMBEDDED_SHARE)
    try:
        for name in options.only:
            folder = options.out / name
            if (folder / TRIALS).exists():
                continue
            folder.mkdir(parents=True, exist_ok=True)
            train(folder, arms()[name], [clip for clip in clips if clip.split == "train"], options.steps, options.seed)
            policy = load_policy(folder)
            trials = follow(policy, Manner(policy.shape.seen), clips, task_model(EnvConfig()))
            trials.to_csv(folder / TRIALS, index=False)
        print(table(options.out, clips))
    except BadInput as error:
        print(error)
        raise SystemExit(EXIT_BAD_INPUT) from None


if __name__ == "__main__":
    main()
