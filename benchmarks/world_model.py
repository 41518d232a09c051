"""Train a policy by the world-model learner on one GPU for some minutes, and try it in MuJoCo C.

    python -m benchmarks.motion_pack g1_moves asap_smpl cmu_bvh --out motions.npz
    python -m benchmarks.world_model --motions motions.npz --minutes 6 --out results/world_model

The task, the motions and the trial are those of `python -m benchmarks.baselines --method ours`, beside which it is run.
A run goes on from the checkpoint in its folder, exactly where it was; `--call-minutes` ends a call early. What the
model gets wrong in held-out worlds is printed at the end, and is in `model_error.csv` by iteration.
`--set learner.horizon=32 env.threshold_end=0.4` changes single settings.
"""

import argparse
import json
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path

import torch

from benchmarks.baselines.__main__ import SETTINGS, main, make_env, training_clips
from benchmarks.baselines.calls import Clock, keep_actor, tell
from benchmarks.baselines.methods import RANDOMISATIONS, changed, method
from benchmarks.baselines.trial import Tried, report
from benchmarks.motion_pack import read_pack
from bumblebee.errors import BadInput
from bumblebee.learning.learner import CURVE
from bumblebee.learning.ranks import check_gpus, join, launch, leave, started_together, this_command
from bumblebee.learning.rollout import Manner
from bumblebee.learning.world_model.config import WorldModelConfig
from bumblebee.learning.world_model.trainer import WorldModelTrainer
from bumblebee.tracking.config import EnvConfig
from bumblebee.tracking.sampling.reflection import reflected

_ENDLESS, _FIRST = 10**9, 10
_SAVE_EVERY, _TELL_EVERY = 120.0, 20.0  # s


@dataclass(frozen=True)
class Settings:
    """Settings that `--set` changes."""

    env: EnvConfig = field(default_factory=EnvConfig)
    learner: WorldModelConfig = field(default_factory=WorldModelConfig)


def parse(arguments: list[str] | None = None) -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.world_model", description=__doc__.splitlines()[0])
    parser.add_argument("--motions", type=Path, required=True, help="file of benchmarks.motion_pack")
    parser.add_argument("--out", type=Path, required=True, help="folder for results; a run found there goes on")
    parser.add_argument("--minutes", type=float, default=6.0, help="training in all")
    parser.add_argument("--iterations", type=int, help="training in all, instead of --minutes")
    parser.add_argument("--gpus", type=int, default=1, help="train on so many together; needs --iterations")
    parser.add_argument("--call-minutes", type=float, help="end this call after so long")
    parser.add_argument("--engine", choices=("mujoco", "mujoco_warp"), default="mujoco_warp")
    parser.add_argument("--worlds", type=int, default=4096)
    parser.add_argument("--threads", type=int, default=2, help="CPU threads")
    parser.add_argument("--jobs", type=int, default=12, help="processes that try the policy; 0: none is tried")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--randomisation", choices=tuple(RANDOMISATIONS), default="light")
    parser.add_argument(
        "--keep-every", type=float, default=0.0, help="seconds of training between actors that are kept"
    )
    parser.add_argument("--parent", type=Path, help="folder of a policy to start from")
    parser.add_argument("--set", nargs="*", default=[], metavar="PATH=VALUE")
    return parser.parse_args(arguments)


def run(options: argparse.Namespace) -> int:
    """Train and try; 0 when done, also if the call was over before."""
    if options.gpus > 1 and not started_together():
        if not options.iterations:
            raise BadInput("--gpus", "--iterations with it: all GPUs follow one schedule", "none")
        check_gpus(options.gpus)
        return launch(options.gpus, this_command())
    sizes = {"engine": options.engine, "num_worlds": options.worlds, "physics_hz": 200.0, "threads": options.threads}
    env = replace(EnvConfig(), **sizes, randomisation=RANDOMISATIONS[options.randomisation])
    settings = changed(Settings(env), options.set)
    rows = read_pack(options.motions)
    options.out.mkdir(parents=True, exist_ok=True)
    (options.out / SETTINGS).write_text(json.dumps(asdict(settings), indent=1) + "\n")
    torch.set_num_threads(options.threads)
    ranks = join(on_gpu=options.engine == "mujoco_warp")
    clock = Clock(options.call_minutes)
    learned = training_clips(rows)
    if settings.learner.symmetry:
        learned += [replace(row, clip=reflected(row.clip)) for row in learned]
    made = make_env(replace(method("ours"), env=settings.env), learned, ranks.seed(options.seed), 1.0, ranks.device)
    config = replace(settings.learner, iterations=options.iterations or _ENDLESS, checkpoint_every=_ENDLESS)
    trainer = WorldModelTrainer(made, config, options.out, options.seed, options.parent, ranks)
    if trainer.iteration:
        print(f"goes on after {trainer.iteration} iterations, {trainer._seconds / 60:.1f} min", flush=True)

    marks: list[tuple[int, float]] = []

    def enough() -> bool:
        marks.append((trainer.iteration, trainer._seconds))
        if len(marks) > _FIRST and not options.iterations:  # the first ones load kernels and record graphs
            (began, before), (now, seconds) = marks[_FIRST], marks[-1]
            left = 60 * options.minutes - seconds
            total = now + max(round(left * (now - began + 1) / (seconds - before + 0.1)), 1)
            trainer.config = replace(trainer.config, iterations=total)
        if clock.due("tell", _TELL_EVERY):
            tell(options.out / CURVE)
        if options.gpus == 1 and clock.due("save", _SAVE_EVERY):  # the ranks must save together
            trainer.save_checkpoint()
        if ranks.first:
            keep_actor(trainer, options.out, options.keep_every)
        return done() or clock.over

    def done() -> bool:
        if options.iterations:
            return trainer.iteration >= options.iterations
        return trainer._seconds >= 60 * options.minutes

    trainer.train("world model", enough)
    trainer.save_checkpoint()
    errors = trainer.accuracy().by_horizon
    leave()
    if not ranks.first:
        return 0
    trainer.policy().save(options.out)
    print(f"trained {trainer.frames / 1e6:.1f} M steps in {trainer._seconds / 60:.1f} min", flush=True)
    print("model, RMS in held-out worlds:", ", ".join(f"{n} {value:.1f}" for n, value in errors.items()), flush=True)
    if options.jobs and done():
        tried = Tried("world_model", options.out, Manner(settings.env.observation))
        report([tried], options.motions, options.out, options.jobs)
    return 0


if __name__ == "__main__":
    main(run, parse)
