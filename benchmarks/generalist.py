"""The paper's transformer against MLPs: distilled from the same experts at equal steps, one line a case.

`python -m benchmarks.generalist --out results.jsonl`: each arm learns by DAgger to do what the shipped policy does on
the embedded motions, and is then tried on every one from its first frame. Cases that the file has are not run again;
one that was cut off goes on. Experts of real motions are distilled by `benchmarks.method`.
"""

import argparse
import json
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, replace
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import pandas as pd
import torch

from bumblebee.last_line import guarded
from bumblebee.learning import pretrained
from bumblebee.learning.generalist.distill import DistillConfig
from bumblebee.learning.generalist.teacher_student import generalist_of
from bumblebee.learning.policy import Policy, load_policy
from bumblebee.learning.trial import World, success_by_family, try_policy
from bumblebee.motion.clip import Clip
from bumblebee.motion.embedded import make_library
from bumblebee.sim.sensors import load_model
from bumblebee.tracking.config import EnvConfig
from bumblebee.tracking.presets import STUDENT

ARMS = {
    "transformer": "the paper's, from what a robot senses over 10 control steps",
    "mlp": "an MLP of as many parameters, from the same",
    "wide": "the paper's MLP, 1024-1024-512, from the same",
    "seeing": "an MLP that starts from base and sees what the experts see",
}
NARROWEST, WIDEST, STEP = 32, 2048, 4


@dataclass(frozen=True)
class Case:
    """One arm with one seed."""

    arm: str
    seed: int
    iterations: int
    worlds: int
    steps: int
    rate: float
    capacity: int
    engine: str


@dataclass(frozen=True)
class Material:
    """Motions, the cluster of each, the experts of the clusters, whom they come from, and their task."""

    clips: list[Clip]
    cluster: list[int]
    experts: dict[int, Policy]
    base: Policy
    task: EnvConfig


def main() -> None:
    """Run what is missing."""
    made = argparse.ArgumentParser(prog="python -m benchmarks.generalist", description=__doc__)
    made.add_argument("--out", type=Path, required=True)
    made.add_argument("--workers", type=int, default=1)
    made.add_argument("--limit", type=int, default=None, help="cases of this call")
    made.add_argument("--seeds", type=int, nargs="+", default=[0])
    made.add_argument("--arms", nargs="+", choices=ARMS, default=["transformer", "mlp"])
    made.add_argument("--iterations", type=int, default=100)
    made.add_argument("--worlds", type=int, default=256)
    made.add_argument("--steps", type=int, default=8)
    made.add_argument("--rate", type=float, default=5e-4)
    made.add_argument("--capacity", type=int, default=400_000)
    made.add_argument("--engine", choices=("mujoco", "mujoco_warp"), default="mujoco")
    made.add_argument("--seconds", type=float, default=1e9, help="of training a case in this call")
    made.add_argument("--scratch", type=Path, default=Path("runs/generalist"))
    raise SystemExit(guarded(lambda: run(made.parse_args())))


def run(options: argparse.Namespace) -> None:
    """The cases that the file lacks, a line each as they are done."""
    known = read_done(options.out)
    asked = (getattr(options, name) for name in ("iterations", "worlds", "steps", "rate", "capacity", "engine"))
    settings = tuple(asked)
    cases = [Case(arm, seed, *settings) for seed in options.seeds for arm in options.arms]
    cases = [case for case in cases if asdict(case) not in known][: options.limit]
    with ProcessPoolExecutor(options.workers, mp_context=get_context("spawn")) as pool:
        for line in pool.map(partial(measured, scratch=options.scratch, seconds=options.seconds), cases):
            if line["done"]:
                with options.out.open("a") as file:
                    file.write(json.dumps(line) + "\n")
            print(json.dumps({name: value for name, value in line.items() if name != "curve"}), flush=True)


def read_done(path: Path) -> list[dict]:
    """The cases that a file has."""
    return [json.loads(line)["case"] for line in path.read_text().splitlines()] if path.exists() else []


def measured(case: Case, scratch: Path, seconds: float) -> dict[str, Any]:
    """Distil one within so many seconds, and try it."""
    torch.set_num_threads(1)
    own = shipped()
    config = settings_of(case, own.task)
    folder = scratch / "-".join(str(value) for value in asdict(case).values())
    distiller = generalist_of(own.clips, own.cluster, own.experts, config, folder, own.base)
    before, began = distiller.policy(), time.monotonic()
    distiller.train(enough=lambda: time.monotonic() - began > seconds)
    curve, student = distiller.curve(), distiller.policy()
    return {
        "case": asdict(case),
        "done": distiller.iteration >= case.iterations,
        "parameters": sum(tensor.numel() for tensor in student.actor.parameters()),
        "frames": distiller.iteration * distiller.frames_each,
        "seconds_of_this_call": round(time.monotonic() - began, 1),
        "samples_gib": round(distiller.gib, 3),
        "kl": round(float(curve["kl"].tail(max(len(curve) // 10, 1)).mean()), 4),
        "least_share": round(float(curve["least_share"].iloc[-1]), 4),
        "curve": [round(float(value), 4) for value in curve["kl"].iloc[:: max(len(curve) // 50, 1)]],
        **tried(own, config, before, student),
    }


def tried(own: Material, config: DistillConfig, before: Policy, student: Policy) -> dict[str, Any]:
    """Success on all motions from the first frame to the last, before and after."""
    world = World(load_model(physics_hz=config.env.physics_hz), threads=1)
    first, last = (try_policy(one, own.clips, world, config.env.ahead) for one in (before, student))
    return {
        "before": by_split(first),
        "after": by_split(last),
        "key_error_cm": round(100 * float(last["key_error"].mean()), 2),
        "families": success_by_family(last),
        "clips": len(own.clips),
    }


def by_split(trials: pd.DataFrame) -> dict[str, float]:
    """Success by split."""
    return {str(name): round(float(rate), 4) for name, rate in trials.groupby("split")["success"].mean().items()}


def shipped() -> Material:
    """The embedded motions by family, and the shipped policy as every family's expert."""
    clips, policy = make_library(), load_policy(pretrained.FOLDER)
    families = sorted({clip.family for clip in clips})
    task = EnvConfig(ahead=policy.shape.ahead, observation=policy.shape.seen, action=policy.shape.action, threads=1)
    return Material(
        clips,
        [families.index(clip.family) for clip in clips],
        dict.fromkeys(range(len(families)), policy),
        policy,
        task,
    )


def settings_of(case: Case, experts: EnvConfig) -> DistillConfig:
    """The algorithm of a case, in the experts' task with a student beside it."""
    task = replace(experts, engine=case.engine, num_worlds=case.worlds)
    config = DistillConfig(
        iterations=case.iterations,
        steps=case.steps,
        learning_rate=case.rate,
        capacity=case.capacity,
        init="base" if case.arm == "seeing" else "scratch",
        model="transformer" if case.arm == "transformer" else "mlp",
        seed=case.seed,
        env=task if case.arm == "seeing" else replace(task, student=STUDENT),
    )
    hidden = {"mlp": equal_mlp(config), "wide": (1024, 1024, 512)}
    return replace(config, hidden=hidden.get(case.arm, config.hidden))


def equal_mlp(config: DistillConfig, inputs: int = 1070, actions: int = 23) -> tuple[int, int, int]:
    """Layers as the paper's MLP has them, w, w, w / 2, with the transformer's number of parameters, nearly."""
    own = config.transformer
    size, wide = own.embedding, own.feed_forward
    block = 5 * size**2 + 2 * size + 2 * (6 * size**2 + size) + 4 * size + 2 * size * wide + wide + size
    wanted = (inputs + 1) * size + block + (size + 1) * own.head[0] + (own.head[0] + 1) * actions

    def count(w: int) -> int:
        return (inputs + 1) * w + (w + 1) * w + (w + 1) * (w // 2) + (w // 2 + 1) * actions

    best = min(range(NARROWEST, WIDEST, STEP), key=lambda w: abs(count(w) - wanted))
    return best, best, best // 2


if __name__ == "__main__":
    main()
