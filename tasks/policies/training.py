"""Training of base, experts and refine: try a policy before and after, or keep the parent's; write its folder."""

import json
import os
import shutil
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import pandas as pd
import torch

from bumblebee.errors import BadInput
from bumblebee.learning import pretrained
from bumblebee.learning.config import PpoConfig
from bumblebee.learning.export import CONTRACT, export_policy
from bumblebee.learning.learner import CURVE, Learner
from bumblebee.learning.learners import Name as LearnerName
from bumblebee.learning.learners import make_learner, played
from bumblebee.learning.policy import Policy, load_policy
from bumblebee.learning.ranks import Ranks, check_gpus, join, launch, leave, this_command
from bumblebee.learning.trial import Trials, World, success_by_family, try_policy
from bumblebee.learning.world_model.config import WorldModelConfig
from bumblebee.motion.clip import Clip
from bumblebee.motion.store import read_library
from bumblebee.ranges import Few, Ranged, Seed, Unfit
from bumblebee.sim.engine_choice import make_engine
from bumblebee.tracking.config import EnvConfig
from bumblebee.tracking.env import TrackingEnv
from bumblebee.tracking.model import task_model
from bumblebee.tracking.sampling.library import MotionLibrary
from bumblebee.tracking.sampling.sampler import ClipShares
from tasks.running import paths
from tasks.running.stage import log_run, output_folder, scratch

BEFORE = "before.parquet"


@dataclass(frozen=True)
class TrainingConfig(Ranged):
    """One training of a tracking policy."""

    seed: Seed = 0
    """Seed of the network, the draws of clips and frames, and the differences between the worlds."""
    env: EnvConfig = field(default_factory=EnvConfig)
    """The task."""
    learner: LearnerName | Literal["none"] = "ppo"
    """Learner: `ppo`, or `world_model`, through a model of the robot; each has the section of its name. `none` trains
    nothing: the policy that it would start from is kept."""
    ppo: PpoConfig = field(default_factory=PpoConfig)
    """PPO, where it trains."""
    world_model: WorldModelConfig = field(default_factory=WorldModelConfig)
    """The learner through a model of the robot, where it trains."""
    trials: Trials = field(default_factory=Trials)
    """How the policy is tried before and after."""
    gpus: Few = 1
    """GPUs of this machine that train together, each with `env.num_worlds` worlds; for the engine `mujoco_warp`."""

    def __post_init__(self) -> None:
        """Refuse a task that the learner cannot take, and several GPUs for an engine that has no use for them."""
        super().__post_init__()
        for name, expected, came in self.algorithm.misfits(self.env):
            raise Unfit(type(self), name, expected, came)
        engine = self.env.engine
        self.require(self.gpus == 1 or engine == "mujoco_warp", "gpus", "1, or the engine `mujoco_warp`")

    @property
    def algorithm(self) -> PpoConfig | WorldModelConfig:
        """The settings of the learner that trains."""
        return self.world_model if self.learner == "world_model" else self.ppo


@dataclass(frozen=True)
class Job:
    """Job of a training: what is trained where, on what, from what."""

    stage: str
    name: str
    out: Path
    clips: Sequence[Clip]
    """Clips to train on."""
    tried: Sequence[Clip]
    """Clips to be tried on, held-out ones too."""
    world: World
    share: ClipShares | None = None
    """Shares of the draws of groups of clips."""
    parent: Path | None = None
    """Folder of the policy to start from."""
    cluster: str | None = None
    round: int | None = None
    model: Path | None = None
    """MJCF of the corrected robot that is trained on, the declared one without; the task adds its ground and delays."""
    better_of: bool = True
    """Whether the parent is kept where training made it no better; a control is what its steps made of it."""


def training_clips() -> list[Clip]:
    """All clips that the filter kept, held-out ones too.

    Raises:
        BadInput: if none is to train on.
    """
    clips = read_library(paths.FILTERED)
    if not any(clip.split == "train" for clip in clips):
        raise BadInput(
            paths.FILTERED / "index.parquet", "at least one motion to train on", "none", "Keep more motions."
        )
    return clips


def cluster_clips(cluster: str, others: float) -> tuple[list[Clip], ClipShares, list[Clip]]:
    """The clips to train a cluster's expert on.

    Args:
        cluster: its name.
        others: share of the draws that goes to the clips of the other clusters.

    Returns:
        the training clips, the shares of the draws of its own and of the others', and the clips to try the expert on:
        all of its cluster.
    """
    labels = pd.read_parquet(paths.LABELS).set_index("name")["cluster"]
    clips = [clip for clip in training_clips() if clip.name in labels.index]
    own = [clip for clip in clips if labels[clip.name] == cluster]
    if not any(clip.split == "train" for clip in own):
        raise BadInput(paths.LABELS, f"motions to train on in cluster {cluster}", "none", "Check `clusters`.")
    used = [clip for clip in clips if clip.split == "train" and (others > 0 or labels[clip.name] == cluster)]
    group = torch.tensor([int(labels[clip.name] != cluster) for clip in used])
    return used, ClipShares(group, torch.tensor([1 - others, others])), own


def train_policy(job: Job, config: TrainingConfig) -> dict[str, Any]:
    """Train, try before and after on the same starts, write the policy's folder; returns its card.

    Without a learner the parent is kept, and nothing is tried.

    How long it took stands in MLflow's run alone: the same inputs make the same folder, whichever machine it is.

    With several GPUs it starts this stage once for each, of which the first does all but the training alone.

    Raises:
        BadInput: if there are fewer GPUs, or the engine has no use for them.
    """
    if config.learner == "none":
        assert job.parent is not None  # a base policy from nothing without a learner is refused with its settings
        print(f"{job.name}: no learner is set: the policy of {_named(job.parent)} is kept", flush=True)
        return keep(job.stage, job.parent, job.out, config, job.cluster, job.round)
    torch.set_num_threads(config.env.threads)
    folder = scratch(f"{job.stage}-{job.name}", job.parent or paths.FILTERED, config)
    if config.gpus > 1 and "RANK" not in os.environ:
        return _train_together(job, config)
    ranks = join() if config.gpus > 1 else Ranks()
    trainer = make_learner(config.algorithm, _env(job, config, ranks), folder, config.seed, job.parent, ranks)
    # A child has its parent's layers: card and run say which.
    config = replace(config, **{config.learner: trainer.config})
    if not ranks.first:
        trainer.train(job.name)
        leave()
        raise SystemExit(0)
    if trainer.iteration == 0:
        _try(trainer.policy(), job, config).to_parquet(folder / BEFORE)
    else:
        print(f"{job.name}: goes on after iteration {trainer.iteration} of {config.algorithm.iterations}", flush=True)
    before = pd.read_parquet(folder / BEFORE)
    trainer.train(job.name)
    leave()
    after = _try(trainer.policy(), job, config)
    policy, kept = trainer.policy(), after
    if job.better_of and job.parent is not None and _score(after) < _score(before):
        policy, kept = load_policy(job.parent), before
    curve = pd.read_csv(folder / CURVE)
    card = _card(job, config, trainer, before, after) | _outcome(before, kept)
    card["kept"] = "child" if kept is after else "parent"
    with output_folder(job.out) as out:
        policy.save(out)
        export_policy(out, policy, config.env.physics_hz)
        curve.drop(columns="seconds").to_csv(out / CURVE, index=False)
        (out / "card.json").write_text(json.dumps(card, indent=1) + "\n")
        after.assign(before=before["success"], key_error_before=before["key_error"]).to_csv(out / "trials.csv")
    _tell(job, card)
    before_rates, last = card["before"], int(curve.iloc[-1, 0])
    metrics = {f"success/{family}": {0: before_rates[family], last: rate} for family, rate in card["after"].items()}
    log_run(
        job.stage,
        cluster=job.cluster,
        round=job.round,
        params=config,
        metrics=metrics,
        curve=folder / CURVE,
    )
    return card


def _env(job: Job, config: TrainingConfig, ranks: Ranks) -> TrackingEnv:
    """This rank's worlds, with the clips that its learner's worlds play."""
    own, world = config.env, job.world
    model = task_model(own, job.model)
    engine = make_engine(own.engine, model, own.num_worlds, own.threads, world.hooks, own.buffers, ranks.device)
    clips, share = played(config.algorithm, job.clips, job.share)
    library = MotionLibrary(clips, own.ahead, device=engine.device)
    return TrackingEnv(library, engine, own, ranks.seed(config.seed), world.action_adapter, share)


def keep(
    stage: str, parent: Path, out: Path, config: TrainingConfig, cluster: str | None, round: int | None
) -> dict[str, Any]:
    """The parent's policy as the stage's, to the byte where it was exported before; returns the card, which says so."""
    card = {"schema": 1, "stage": stage, "cluster": cluster, "round": round, "parent": _named(parent), "kept": "parent"}
    card |= {"iterations": 0, "frames": 0}
    with output_folder(out) as folder:
        if (parent / CONTRACT).exists():
            shutil.copytree(parent, folder, dirs_exist_ok=True, ignore=shutil.ignore_patterns(CURVE, "trials.csv"))
        else:  # the policies that come with the code
            policy = load_policy(parent)
            policy.save(folder)
            export_policy(folder, policy, config.env.physics_hz)
        (folder / "card.json").write_text(json.dumps(card, indent=1) + "\n")
    log_run(stage, cluster=cluster, round=round, params=config, tags={"kept": "parent"})
    return card


def _train_together(job: Job, config: TrainingConfig) -> dict[str, Any]:
    """Run this stage as `config.gpus` processes; the card that the first of them wrote."""
    check_gpus(config.gpus)
    if status := launch(config.gpus, this_command()):
        raise SystemExit(status)
    return json.loads((job.out / "card.json").read_text())


def _try(policy: Policy, job: Job, config: TrainingConfig) -> pd.DataFrame:
    return try_policy(policy, job.tried, job.world, config.env.ahead, config.trials)


def _score(trials: pd.DataFrame) -> tuple[float, float]:
    """Success on the training clips, then accuracy: what decides between parent and child."""
    train = trials[trials["split"] == "train"]
    return float(train["success"].mean()), -float(train["key_error"].mean())


def _card(
    job: Job, config: TrainingConfig, trainer: Learner, before: pd.DataFrame, after: pd.DataFrame
) -> dict[str, Any]:
    curve, unused = pd.read_csv(trainer.folder / CURVE), {"ppo", "world_model"} - {config.learner}
    return {
        "schema": 1,
        "stage": job.stage,
        "cluster": job.cluster,
        "round": job.round,
        "parent": _named(job.parent) if job.parent else None,
        "learner": config.learner,
        "iterations": trainer.iteration,
        "frames": trainer.frames,
        "unstable_worlds": int(curve["unstable"].sum()),
        "training_clips": [clip.name for clip in job.clips],
        "rollouts_a_clip": config.trials.repeats,
        "trained": {"success": success_by_family(after), "gained": _new(after, before), "lost": _new(before, after)},
        "config": {name: value for name, value in asdict(config).items() if name not in unused},
    }


def _named(parent: Path) -> str:
    """The parent's folder, or that it is the policy that comes with the code, wherever that lies."""
    return pretrained.NAMES.get(parent, str(parent))


def _outcome(before: pd.DataFrame, kept: pd.DataFrame) -> dict[str, Any]:
    """Before, and after with the policy that is kept: the one in this folder, be it the parent's."""
    card: dict[str, Any] = {}
    for when, trials in (("before", before), ("after", kept)):
        card[when] = success_by_family(trials)
        held_out = trials[trials["split"] == "test"]
        card[f"{when}_held_out"] = success_by_family(held_out) if len(held_out) else {}
        card[f"{when}_key_error"] = round(float(trials["key_error"].mean()), 4)
    return card


def _new(trials: pd.DataFrame, others: pd.DataFrame) -> list[str]:
    """Clips that succeed in some trial where the other policy's did not."""
    return sorted(set(trials["name"][trials["success"] & ~others["success"]]))


def _tell(job: Job, card: dict[str, Any]) -> None:
    before, after = card["before"], card["after"]
    families = ", ".join(f"{f} {before.get(f, 0):.0%} -> {rate:.0%}" for f, rate in after.items())
    print(f"{job.name}: success {families}; key error {card['after_key_error'] * 100:.1f} cm")
    if card["kept"] == "parent":
        rate = card["trained"]["success"]["all"]
        print(f"{job.name}: training did not improve it ({rate:.0%}): the parent's policy is kept")
