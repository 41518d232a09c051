"""Five motions for mjlab and us, our learners on them, and the table of docs/training.md, "Beside mjlab".

    python -m benchmarks.mjlab motions motions.npz --out five.npz                          # of benchmarks.motion_pack
    python -m benchmarks.mjlab world_model five.npz --minutes 3 --out results/world_model
    python -m benchmarks.mjlab ppo five.npz --minutes 5 --out results/ppo
    python -m benchmarks.mjlab table results/mjlab results/world_model results/ppo --out docs/training.md

`benchmarks.world_model` or `benchmarks.baselines --method ours` trains, in a process of its own, with the settings of
that page. Every actor that it keeps is tried in MuJoCo C at 200 Hz: from each motion's first frame, without noise, on
the robot as it is, lost where the pelvis is .25 m too high or low or gravity along its z is off by .8. For mjlab see
`benchmarks.mjlab.theirs`. Its G1 has wrists: in our motions they stay at zero.
"""

import argparse
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import torch

from benchmarks.baselines.__main__ import main
from benchmarks.baselines.trial import PHYSICS_HZ
from benchmarks.mjlab.record import FOLLOWED, write_followed
from benchmarks.motion_pack import FPS, read_pack, whole_motions, write_pack
from bumblebee.errors import BadInput
from bumblebee.learning.policy import Policy, load_policy
from bumblebee.learning.rollout import Manner, roll_out
from bumblebee.learning.three_rules import upright
from bumblebee.motion.clip import Clip
from bumblebee.robot.facts import joint_names
from bumblebee.sim.engine_choice import make_engine
from bumblebee.sim.sensors import load_model
from bumblebee.tracking.sampling.library import MotionLibrary

FIVE = ("walk_level1", "step_forward_forward_level1", "squat_level1", "jump_forward_level1", "kick_level1")
"""The first motion of each of five families of ASAP's."""
_TASK = ["env.sampler_stretch=1.0", "env.sampler_memory=0.98", "env.sampler_floor=0.1", "env.threshold_end=0.35"]
_TASK += ["env.threshold_share=0.4", "env.ahead=[0.1,0.3,0.6,1.0]"]
_PPO = ["ppo.symmetry=true", "ppo.hidden=[1024,512,256]", "ppo.entropy=0.003", "ppo.learning_rate_range=[1e-5,2e-3]"]
_PPO = ["benchmarks.baselines", "--method", "ours", "--randomisation", "light", "--jobs", "1", "--set", *_TASK, *_PPO]
_MODEL = ["benchmarks.world_model", "--jobs", "0", "--set", *_TASK, "learner.symmetry=true"]
LEARNERS = {"world_model": [*_MODEL, "learner.compile=true"], "world_model_eager": _MODEL, "ppo": _PPO}
BEGIN, END = "<!-- python -m benchmarks.mjlab table writes this -->", "<!-- end -->"


def motions(pack: Path, out: Path, names: tuple[str, ...] = FIVE) -> None:
    """Write a pack of these motions, with what its arrays do not say: names of joints, and frames a second."""
    whole = {row.clip.name: row for row in whole_motions(read_pack(pack))}
    if missing := [name for name in names if name not in whole]:
        raise BadInput(f"{pack}: motions", ", ".join(names), f"no {', '.join(missing)}")
    write_pack(out, [replace(whole[name], clip=replace(whole[name].clip, split="train")) for name in names])
    with np.load(out) as file:
        arrays = dict(file)
    np.savez_compressed(out, fps=FPS, joint_names=joint_names(), **arrays)


@torch.inference_mode()
def followed(policy: Policy, clips: list[Clip]) -> dict[str, tuple[bool, float]]:
    """Whether each motion is followed to its end by the rule above, and the share that is, by its name."""
    library = MotionLibrary(clips, policy.shape.ahead)
    engine = make_engine("mujoco", load_model(physics_hz=PHYSICS_HZ), len(clips), 1)
    kept, steps = torch.ones(len(clips), dtype=torch.bool), torch.zeros(len(clips))
    for tick in roll_out(policy, Manner(policy.shape.seen), library, engine):
        kept &= (upright(tick.state, tick.ref) & ~tick.unstable) | ~tick.running
        steps += kept & tick.running
    share = steps / (library.length - 1)
    return {clip.name: (bool(kept[i]), float(share[i])) for i, clip in enumerate(clips)}


def learn(learner: str, pack: Path, out: Path, minutes: float, every: float, more: list[str]) -> None:
    """Train, try every actor that was kept and write `followed.csv`; `more` are options of the training."""
    began, clips = time.time(), [row.clip for row in read_pack(pack)]
    command = [sys.executable, "-m", *LEARNERS[learner], "--motions", str(pack), "--out", str(out), *more]
    if status := subprocess.run([*command, "--minutes", str(minutes), "--keep-every", str(every)]).returncode:
        raise BadInput(f"{command[2]} in {out}", "a training that ends well", f"status {status}")
    kept = {float(folder.name[3:-1]): folder for folder in out.glob("at-*s")}
    marks = {mark: (folder / "policy.pt").stat().st_mtime - began for mark, folder in kept.items()}
    torch.set_num_threads(1)
    write_followed(out, learner, marks, {mark: followed(load_policy(folder), clips) for mark, folder in kept.items()})


def table(runs: list[Path]) -> str:
    """A row a run: when half and all motions were first followed, and what the last actor follows."""
    lines = ["| | half of the motions followed after | all followed after | at the end |", "|---|---|---|---|"]
    for run in runs:
        if not (run / FOLLOWED).exists():
            raise BadInput(run / FOLLOWED, "a run of this benchmark", "no such file")
        rows = pd.read_csv(run / FOLLOWED)
        each = rows.groupby("with_start_s", as_index=False).agg(
            {"trained_s": "first", "frames": "first", "followed": "sum", "share": "mean"}
        )
        count, last, firsts = rows["motion"].nunique(), each.iloc[-1], []
        for least in (count / 2, count):
            found = each[each["followed"] >= least]
            firsts.append(_when(found.iloc[0]) if len(found) else "not reached")
        end = f"{last.followed:.0f} of {count}, {last.share:.2f} of their frames: {_when(last)}"
        lines.append("| " + " | ".join([rows["learner"].iloc[0], *firsts, end]) + " |")
    return "\n".join(lines)


def _when(at: pd.Series) -> str:
    return f"{at.trained_s / 60:.1f} min ({at.with_start_s / 60:.1f} from its start), {at.frames / 1e6:.1f} M steps"


def put(text: str, page: Path) -> None:
    """Put a table between the marks of a page."""
    before, mark, rest = page.read_text().partition(BEGIN)
    if not mark:
        raise BadInput(page, f"a line {BEGIN}", "none")
    page.write_text(f"{before}{BEGIN}\n\n{text}\n\n{END}{rest.partition(END)[2]}")


def run(options: argparse.Namespace) -> int:
    """Do what was asked for."""
    if options.work == "motions":
        motions(options.given[0], options.out)
    elif options.work == "table":
        put(table(options.given), options.out)
    else:
        learn(options.work, options.given[0], options.out, options.minutes, options.every, options.more)
    return 0


def parse(arguments: list[str] | None = None) -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.mjlab", description=__doc__.splitlines()[0])
    parser.add_argument("work", choices=("motions", *LEARNERS, "table"))
    parser.add_argument("given", type=Path, nargs="+", help="a pack, or folders of runs")
    parser.add_argument("--out", type=Path, required=True, help="the file of motions, a run's new folder, or the page")
    parser.add_argument("--minutes", type=float, default=3.0, help="of training in all")
    parser.add_argument("--every", type=float, default=15.0, help="seconds of training between actors that are tried")
    options, options.more = parser.parse_known_args(arguments)
    return options


if __name__ == "__main__":
    main(run, parse)
