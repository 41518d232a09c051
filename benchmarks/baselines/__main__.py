"""Train one way of whole-body control on one GPU for some minutes, and try it in MuJoCo C.

    python -m benchmarks.motion_pack g1_moves asap_g1 --out motions.npz
    python -m benchmarks.baselines --method omnih2o --motions motions.npz --minutes 20 --out results/omnih2o

`ours` is the task of this repository (`bumblebee.tracking`), `paper` the BumbleBee paper's teacher and student without
clusters, experts and delta actions (its "General Init"), the others are those of `others/`. All learn from
the same motions for the same time on the same engine; a method with a student gives it 30 % of that time. The
curriculum follows the time. `--call-minutes` ends a run early; the same command goes on from `resume.pt` in the output
folder, with new episodes. `--set env.threshold_end=0.3 ppo.entropy=0.003` changes single settings. `--variety 2` adds
two varied copies of each motion that is learned from, `--keep-every 30` keeps the actor of each half minute.
"""

import argparse
import json
import time
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path

import torch
from torch import Tensor

from benchmarks.baselines.calls import Clock, keep_actor, resume, save, tell
from benchmarks.baselines.methods import METHODS, RANDOMISATIONS, Method, changed, method, require_kept
from benchmarks.baselines.others.dagger import Distiller
from benchmarks.baselines.others.env import BaselineEnv
from benchmarks.baselines.others.library import MovingLibrary
from benchmarks.baselines.trial import Tried, report
from benchmarks.baselines.variety import shares, varied
from benchmarks.motion_pack import Packed, read_pack, whole_motions
from bumblebee.errors import EXIT_BAD_INPUT, BadInput
from bumblebee.learning.generalist.distill import DistillConfig, distill
from bumblebee.learning.learner import CURVE
from bumblebee.learning.policy import Policy, load_policy
from bumblebee.learning.ppo.learner import Trainer
from bumblebee.motion.clip import Clip
from bumblebee.motion.pieces import motion_of
from bumblebee.sim.engine_choice import make_engine
from bumblebee.tracking.config import ObservationConfig
from bumblebee.tracking.env import TrackingEnv
from bumblebee.tracking.model import task_model
from bumblebee.tracking.sampling.library import MotionLibrary
from bumblebee.tracking.sampling.sampler import ClipShares

STUDENT_SHARE = 0.3
RESUME, STUDENT_FOLDER, SETTINGS = "resume.pt", "student", "settings.json"
_ENDLESS = 10**9
_SAVE_EVERY, _TELL_EVERY = 120.0, 20.0  # s


def training_clips(rows: list[Packed]) -> list[Packed]:
    """Clips to learn from: whole motions, and the kept pieces of those with a gap; none that is held out."""
    whole = whole_motions(rows)
    complete = {(row.group, row.clip.name) for row in whole}
    rest = [row for row in rows if row.kept and (row.group, motion_of(row.clip.name)) not in complete]
    return [row for row in [*whole, *rest] if row.clip.split == "train"]


def make_env(own: Method, rows: list[Packed], seed: int, share: float, device: str = "cuda") -> TrackingEnv:
    """The method's task; embedded motions are drawn `share` times as often for their length."""
    task = own.env
    sizes = task_model(task), task.num_worlds, task.threads
    engine = make_engine(task.engine, *sizes, buffers=task.buffers, device=device)
    clips = [row.clip for row in rows]
    factors = grouped(shares(rows, share), clips)
    if own.baseline is None:
        return TrackingEnv(MotionLibrary(clips, task.ahead, device=engine.device), engine, task, seed, None, factors)
    library = MovingLibrary(clips, task.ahead, device=engine.device)
    return BaselineEnv(library, engine, replace(own.baseline, env=task), seed, factors)


def grouped(factors: Tensor, clips: list[Clip]) -> ClipShares:
    """Clips of the same factor (N,) as a group, whose share of the draws is that factor times its frames."""
    values, group = torch.unique(factors, return_inverse=True)
    frames = torch.zeros(len(values)).index_add(0, group, torch.tensor([float(clip.frames) for clip in clips]))
    return ClipShares(group, values * frames)


def train_teacher(
    own: Method, rows: list[Packed], options: argparse.Namespace, clock: Clock, minutes: float
) -> Trainer:
    """Train, or go on, until `minutes` of training are done or the call is over."""
    alone = replace(
        own, env=replace(own.env, student=ObservationConfig(terms=()))
    )  # nobody sees the student's part yet
    env = make_env(alone, rows, options.seed, options.embedded)
    config = replace(own.ppo, iterations=_ENDLESS, checkpoint_every=_ENDLESS)
    trainer = Trainer(env, config, options.out, options.seed, options.parent)
    if (options.out / RESUME).exists():
        resume(trainer, options.out / RESUME)
    elif options.std:
        trainer.algorithm.actor.distribution.std_param.data.fill_(options.std)

    def enough() -> bool:
        if trainer.iteration:
            each = trainer._seconds / trainer.iteration
            trainer.config = replace(trainer.config, iterations=max(round(60 * minutes / each), trainer.iteration + 1))
        if clock.due("tell", _TELL_EVERY):
            tell(options.out / CURVE)
        if clock.due("save", _SAVE_EVERY):
            save(trainer, options.out / RESUME)
        keep_actor(trainer, options.out, options.keep_every)
        return trainer._seconds >= 60 * minutes or clock.over

    if trainer._seconds < 60 * minutes:
        trainer.train(own.name, enough)
    save(trainer, options.out / RESUME)
    return trainer


def train_student(
    own: Method, rows: list[Packed], teacher: Policy, options: argparse.Namespace, clock: Clock
) -> Policy | None:
    """The student of a finished teacher, or None if the call is over before it is done."""
    quiet = replace(own, env=replace(own.env, observation=replace(own.env.observation, noise=0.0)))
    env, seconds = make_env(quiet, rows, options.seed + 1, options.embedded), 60 * STUDENT_SHARE * options.minutes
    if isinstance(own.student, DistillConfig):
        return _aggregated(env, own.student, teacher, seconds)
    distiller = Distiller(env, teacher, own.student, options.out / STUDENT_FOLDER, options.seed)

    def enough() -> bool:
        if clock.due("tell", _TELL_EVERY):
            tell(options.out / STUDENT_FOLDER / "student.csv")
        return distiller.seconds >= seconds or clock.over

    distiller.train(enough)
    distiller.save_checkpoint()
    return distiller.policy() if distiller.seconds >= seconds else None


def _aggregated(env: TrackingEnv, config: DistillConfig, teacher: Policy, seconds: float) -> Policy:
    """The paper's DAgger over all that was gathered; it starts over when a call ends in it."""
    began, done = time.monotonic(), [0]

    def enough() -> bool:
        done[0] += 1
        return time.monotonic() - began > seconds

    # The experts' share of the steps falls over the first half of the iterations: as many as will fit.
    each = _seconds_a_step(env)
    config = replace(config, iterations=max(round(seconds / (config.steps * each)), 1))
    student, curve = distill(env, {0: teacher}, [0] * len(env.library), config, enough=enough)
    print(f"{done[0]} rounds of DAgger, KL {float(curve['kl'].iloc[-1]):.3f}", flush=True)
    return student


def _seconds_a_step(env: TrackingEnv, steps: int = 50) -> float:
    """Time of a control step, about doubled by the learning that goes with it [s]."""
    still = torch.zeros(env.num_envs, env.num_actions, device=env.device)
    env.step(still)
    began = time.monotonic()
    for _ in range(steps):
        env.step(still)
    env.engine.check()  # waits for the device
    return 2 * (time.monotonic() - began) / steps


def run(options: argparse.Namespace) -> int:
    """Train and try; 0 when done, also if the call was over before."""
    own = method(options.method)
    if options.randomisation:
        own = replace(own, env=replace(own.env, randomisation=RANDOMISATIONS[options.randomisation]))
    sizes = {"engine": options.engine, "num_worlds": options.worlds, "physics_hz": 200.0, "threads": options.threads}
    own = changed(replace(own, env=replace(own.env, **sizes)), options.set)
    rows = read_pack(options.motions)
    settings = {"method": own.name, "minutes": options.minutes, "env": asdict(own.env), "ppo": asdict(own.ppo)}
    settings |= {"student": asdict(own.student) if own.student else None, "parent": str(options.parent or "")}
    settings |= {name: getattr(options, name) for name in ("variety", "seed", "embedded", "std", "keep_every")}
    if (options.out / RESUME).exists() and (options.out / SETTINGS).exists():
        require_kept(settings, options.out / SETTINGS)
    options.out.mkdir(parents=True, exist_ok=True)
    (options.out / SETTINGS).write_text(json.dumps(settings, indent=1) + "\n")
    torch.set_num_threads(options.threads)
    clock, learned = Clock(options.call_minutes), training_clips(rows)
    learned += varied(learned, options.variety)
    share = STUDENT_SHARE if own.student else 0.0
    trainer = train_teacher(own, learned, options, clock, (1 - share) * options.minutes)
    policy: Policy | None = trainer.policy()
    # Who has a student is nobody's parent: its critic is not kept.
    (Policy(policy.actor, {}, policy.shape) if own.student else policy).save(options.out)
    if trainer._seconds < 60 * (1 - share) * options.minutes:
        print("the call is over: the same command goes on", flush=True)
        return 0
    print(f"trained {trainer.frames / 1e6:.1f} M steps in {trainer._seconds / 60:.1f} min", flush=True)
    del trainer
    folders = {"teacher" if own.student else own.name: (options.out, own.first)}
    if own.student:
        target = options.out / STUDENT_FOLDER
        target.mkdir(exist_ok=True)
        if not (target / "policy.pt").exists():
            policy = train_student(own, learned, load_policy(options.out), options, clock)
            if policy is None:
                print("the call is over: the same command goes on", flush=True)
                return 0
            policy.save(target)
        folders[own.name] = (target, own.tried)
    tried = [Tried(name, folder, manner) for name, (folder, manner) in folders.items()]
    report(tried, options.motions, options.out, options.jobs)
    return 0


def parse(arguments: list[str] | None = None) -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--method", choices=METHODS, required=True)
    parser.add_argument("--motions", type=Path, required=True, help="file of benchmarks.motion_pack")
    parser.add_argument("--out", type=Path, required=True, help="folder for results; a run found there goes on")
    parser.add_argument("--minutes", type=float, default=20.0, help="training in all, the student's included")
    parser.add_argument("--call-minutes", type=float, help="end this call after so long")
    parser.add_argument("--engine", choices=("mujoco", "mujoco_warp"), default="mujoco_warp")
    parser.add_argument("--worlds", type=int, default=8192)
    parser.add_argument("--threads", type=int, default=2, help="CPU threads")
    parser.add_argument("--jobs", type=int, default=12, help="processes that try the policy")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--embedded", type=float, default=1.0, help="factor on how often embedded motions are drawn")
    parser.add_argument("--randomisation", choices=tuple(RANDOMISATIONS), help="instead of the method's own")
    parser.add_argument("--parent", type=Path, help="folder of a policy to start from")
    parser.add_argument("--std", type=float, default=0.0, help="the actions' first deviation, instead of the parent's")
    parser.add_argument("--variety", type=int, default=0, help="varied copies of each motion, drawn as often in all")
    parser.add_argument(
        "--keep-every", type=float, default=0.0, help="seconds of training between actors that are kept"
    )
    parser.add_argument("--set", nargs="*", default=[], metavar="PATH=VALUE")
    return parser.parse_args(arguments)


def main(
    work: Callable[[argparse.Namespace], int] = run, read: Callable[[], argparse.Namespace] = lambda: parse()
) -> None:
    """Run; bad input is one line and status 2."""
    try:
        raise SystemExit(work(read()))
    except BadInput as error:
        print(error, flush=True)
        raise SystemExit(EXIT_BAD_INPUT) from None


if __name__ == "__main__":
    main()
