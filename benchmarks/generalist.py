"""The paper's transformer against an MLP of as many parameters: one teacher or many, equal steps, one line a case.

`python -m benchmarks.generalist --out results.jsonl`: each model learns by DAgger to do what the shipped policy does on
the embedded motions, from what a robot senses over 10 control steps, and is then tried on every motion from its first
frame. `--experts c0=folder c1=folder` with `--motions` and `--labels` distils experts by cluster instead. Cases that
the file has are not run again; a case that was cut off goes on from its checkpoint in `--scratch`.
"""

import argparse
import json
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, replace
from multiprocessing import get_context
from pathlib import Path

import pandas as pd
import torch

from bumblebee.errors import BadInput
from bumblebee.last_line import guarded
from bumblebee.learning import pretrained
from bumblebee.learning.distill import DistillConfig
from bumblebee.learning.policy import Policy, load_policy
from bumblebee.learning.teacher_student import generalist_of
from bumblebee.learning.trial import World, success_by_family, try_policy
from bumblebee.motion.clip import Clip
from bumblebee.motion.embedded import make_library
from bumblebee.motion.store import read_library
from bumblebee.sim.sensors import load_model
from bumblebee.tracking.config import EnvConfig
from bumblebee.tracking.presets import STUDENT

MODELS = ("mlp", "transformer")
NARROWEST, WIDEST, STEP = 32, 2048, 4


@dataclass(frozen=True)
class Case:
    """One model with one seed."""

    model: str
    seed: int
    iterations: int
    worlds: int
    steps: int
    rate: float
    engine: str


@dataclass(frozen=True)
class Given:
    """What is distilled: folders of experts by cluster, a library of motions and their labels; empty: the shipped."""

    experts: tuple[str, ...]
    motions: Path | None
    labels: Path | None
    scratch: Path
    minutes: float


def main() -> None:
    """Run what is missing."""
    made = argparse.ArgumentParser(prog="python -m benchmarks.generalist", description=__doc__)
    made.add_argument("--out", type=Path, required=True)
    made.add_argument("--workers", type=int, default=1)
    made.add_argument("--limit", type=int, default=None, help="cases of this call")
    made.add_argument("--seeds", type=int, nargs="+", default=[0])
    made.add_argument("--models", nargs="+", choices=MODELS, default=list(MODELS))
    made.add_argument("--iterations", type=int, default=100)
    made.add_argument("--worlds", type=int, default=256)
    made.add_argument("--steps", type=int, default=8)
    made.add_argument("--rate", type=float, default=5e-4)
    made.add_argument("--engine", choices=("mujoco", "mujoco_warp"), default="mujoco")
    made.add_argument("--minutes", type=float, default=1e9, help="of training a case; it then goes on in the next call")
    made.add_argument("--experts", nargs="*", default=[], metavar="CLUSTER=FOLDER")
    made.add_argument("--motions", type=Path)
    made.add_argument("--labels", type=Path, help="parquet with name and cluster")
    made.add_argument("--scratch", type=Path, default=Path("runs/generalist"))
    options = made.parse_args()
    raise SystemExit(guarded(lambda: run(options)))


def run(options: argparse.Namespace) -> None:
    """The cases that the file lacks, a line each as they are done."""
    given = Given(tuple(options.experts), options.motions, options.labels, options.scratch, options.minutes)
    known = read_done(options.out)
    asked = (options.iterations, options.worlds, options.steps, options.rate, options.engine)
    cases = [Case(model, seed, *asked) for seed in options.seeds for model in options.models]
    cases = [case for case in cases if asdict(case) not in known][: options.limit]
    with ProcessPoolExecutor(options.workers, mp_context=get_context("spawn")) as pool:
        for line in pool.map(measured, cases, [given] * len(cases)):
            if line["done"]:
                with options.out.open("a") as file:
                    file.write(json.dumps(line) + "\n")
            print(json.dumps({name: value for name, value in line.items() if name != "curve"}), flush=True)


def read_done(path: Path) -> list[dict]:
    """The cases that a file has."""
    return [json.loads(line)["case"] for line in path.read_text().splitlines()] if path.exists() else []


def measured(case: Case, given: Given) -> dict:
    """Distil and try one."""
    torch.set_num_threads(1)
    clips, cluster, experts = material(given)
    config = settings(case, experts[0])
    folder = given.scratch / f"{case.model}-{case.seed}-{case.iterations}-{case.worlds}-{case.rate:g}"
    distiller = generalist_of(
        [c for c in clips if c.split == "train"], train_only(clips, cluster), experts, config, folder
    )
    before, began = distiller.policy(), time.monotonic()
    distiller.train(enough=lambda: time.monotonic() - began > 60 * given.minutes)
    seconds, curve, student = time.monotonic() - began, distiller.curve(), distiller.policy()
    world = World(load_model(physics_hz=config.env.physics_hz), threads=1)
    tried = {
        name: try_policy(one, clips, world, config.env.ahead) for name, one in (("before", before), ("after", student))
    }
    return {
        "case": asdict(case),
        "done": distiller.iteration >= case.iterations,
        "parameters": sum(tensor.numel() for tensor in student.actor.parameters()),
        "frames": distiller.iteration * distiller.frames_each,
        "seconds_of_this_call": round(seconds, 1),
        "samples_gib": round(distiller.gib, 3),
        "kl": round(float(curve["kl"].tail(max(len(curve) // 10, 1)).mean()), 4),
        "least_share": round(float(curve["least_share"].mean()), 4),
        "before": split_rates(tried["before"]),
        "after": split_rates(tried["after"]),
        "key_error_cm": round(100 * float(tried["after"]["key_error"].mean()), 2),
        "families": success_by_family(tried["after"]),
        "clips": len(clips),
        "curve": [round(float(value), 4) for value in curve["kl"].iloc[:: max(len(curve) // 50, 1)]],
    }


def material(given: Given) -> tuple[list[Clip], list[int], dict[int, Policy]]:
    """Motions, the cluster of each, and its expert."""
    clips = make_library() if given.motions is None else read_library(given.motions)
    if not given.experts:
        shipped = load_policy(pretrained.FOLDER)
        families = sorted({clip.family for clip in clips})
        return clips, [families.index(clip.family) for clip in clips], {i: shipped for i in range(len(families))}
    if given.labels is None:
        raise BadInput("--labels", "the clusters of the motions", "nothing", "Give clusters/labels.parquet.")
    named = dict(pair.split("=", 1) for pair in given.experts)
    labels = pd.read_parquet(given.labels).set_index("name")["cluster"]
    clips = [clip for clip in clips if labels.get(clip.name) in named]
    order = list(named)
    return (
        clips,
        [order.index(labels[clip.name]) for clip in clips],
        {index: load_policy(Path(folder)) for index, folder in enumerate(named.values())},
    )


def train_only(clips: list[Clip], cluster: list[int]) -> list[int]:
    """The clusters of the motions to train on."""
    return [index for clip, index in zip(clips, cluster, strict=True) if clip.split == "train"]


def split_rates(trials: pd.DataFrame) -> dict[str, float]:
    """Success by split."""
    return {str(name): round(float(rate), 4) for name, rate in trials.groupby("split")["success"].mean().items()}


def settings(case: Case, expert: Policy) -> DistillConfig:
    """The task is the expert's, with a student beside it; an MLP has as many parameters as the transformer."""
    seen = expert.shape
    task = EnvConfig(
        engine=case.engine,
        num_worlds=case.worlds,
        threads=1,
        ahead=seen.ahead,
        observation=seen.seen,
        student=STUDENT,
        action=seen.action,
    )
    config = DistillConfig(
        iterations=case.iterations,
        steps=case.steps,
        learning_rate=case.rate,
        init="scratch",
        model=case.model,
        seed=case.seed,
        env=task,
    )
    return replace(config, hidden=equal_mlp(config)) if case.model == "mlp" else config


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
