"""Four arms of the measured loop in the world model, at equal steps, on sealed robots.

    python -m benchmarks.measured_loop --out runs/measured-loop --call-minutes 8      # again, until it says "done"
    python -m benchmarks.measured_loop --out runs/measured-loop --table

Each robot is recorded with the shipped policy and diagnosed. A world model of the declared simulator goes on in it, or
in the corrected one; a residual learns from the recordings what either misses; the shipped policy is trained on through
the model and the residual, if the gate keeps it, and tried on the robot. `--until replay` ends before policies are
trained. Settings are frozen when a run begins; each part that was done is kept, and a call goes on where the last
ended. On a GPU: `--set env.engine=mujoco_warp env.num_worlds=4096 learner.iterations=2000 residual.updates=500 ...`. On
a bare machine kernels take two minutes, a part of a model 5 s, a residual of 2,000 updates up to four minutes and more:
record and diagnose on a CPU beforehand (`--until diagnosis`), and let no call end in a residual's fit.
"""

import argparse
import time
from collections.abc import Iterator
from pathlib import Path

import mujoco
import torch

from benchmarks.baselines.methods import changed
from benchmarks.measured_loop.settings import ARMS, Loop
from benchmarks.measured_loop.tables import tables
from benchmarks.measured_loop.work import Work
from benchmarks.study.settings import freeze
from bumblebee.io.read import file_hash
from bumblebee.last_line import guarded
from bumblebee.learning import pretrained
from bumblebee.learning.policy import FILE

STAGES = ("robot", "record", "diagnosis", "model", "residual", "replay", "policy", "tried")


def parse(arguments: list[str] | None = None) -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.measured_loop", description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, required=True, help="folder for results; a run found there goes on")
    parser.add_argument("--seeds", type=int, nargs="+", default=[0])
    parser.add_argument("--robots", type=int, nargs="+", help="numbers of the robots of this call; else all")
    parser.add_argument("--until", choices=STAGES, default=STAGES[-1], help="last step of this call")
    parser.add_argument("--call-minutes", type=float, help="begin nothing more after so long")
    parser.add_argument("--table", action="store_true", help="print what is there, and do nothing")
    parser.add_argument("--set", nargs="*", default=[], metavar="PATH=VALUE")
    return parser.parse_args(arguments)


def run(options: argparse.Namespace) -> None:
    """Print the steps that are left, or the tables."""
    if options.table:
        print(tables(options.out))
        return
    mujoco.set_mju_user_warning(lambda text: None)
    config = changed(Loop(), options.set)
    torch.set_num_threads(config.env.threads)
    print("settings", freeze(options.out, config, policy=file_hash(pretrained.FOLDER / FILE)), flush=True)
    end = None if options.call_minutes is None else time.monotonic() + 60 * options.call_minutes

    def over() -> bool:
        return end is not None and time.monotonic() > end

    for seed in options.seeds:
        work = Work(config, options.out, seed, over)
        for what, done in steps(work, options.robots, options.until):
            print(f"seed {seed}: {what}", flush=True)
            if not done or over():
                print("goes on: the same command again", flush=True)
                return
    print("done", flush=True)


def steps(work: Work, robots: list[int] | None, until: str) -> Iterator[tuple[str, bool]]:
    """Do one step after the other: what it was, and whether it came to its end."""
    wanted = STAGES[: STAGES.index(until) + 1]
    names = [name for i, name in enumerate(work.names) if robots is None or i in robots]
    for stage in wanted[:3]:
        for name in names:
            getattr(work, stage)(name)
            yield f"{stage} {name}", True
    for name in names:
        for physics in (False, True):
            if "model" in wanted:
                yield f"model {name}, {'corrected' if physics else 'declared'}", work.model(name, physics)
            if "residual" in wanted:
                work.residual(name, physics)
                yield f"residual {name}, {'both' if physics else 'alone'}", True
        if "replay" in wanted:
            work.replay(name)
            yield f"replay {name}", True
    for name in names if "policy" in wanted else []:
        for arm in ARMS:
            yield f"policy {name}, {arm}", work.trained(name, arm)
            if "tried" in wanted:
                work.tried(name, arm)
                yield f"tried {name}, {arm}", True


if __name__ == "__main__":
    raise SystemExit(guarded(lambda: run(parse())))
