"""Train a policy on motions for some minutes: policy, ONNX file, card and film in one folder."""

import contextlib
import hashlib
import json
import shutil
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from bumblebee.api import checks
from bumblebee.errors import BadInput
from bumblebee.io.write import new_folder, refuse_foreign, try_output
from bumblebee.last_line import Stopped
from bumblebee.motion.clip import Clip
from bumblebee.policy.card_text import CARD, NOTHING
from bumblebee.ranges import Few, Name, PartOf, Range, Ranged, Seed

if TYPE_CHECKING:
    import pandas as pd

    from bumblebee.learning.learner import Learner
    from bumblebee.learning.policy import Policy

_FIRST = 3  # iterations that measure the speed: the first of them loads kernels
_CHECKPOINT = 60.0  # s of training


@dataclass(frozen=True)
class TrainConfig(Ranged):
    """How a policy is trained."""

    minutes: Annotated[float, Range(above=0, most=100_000)] = 15.0
    """Time of the training itself [min]; trials before and after come on top."""
    gpu: bool = False
    """Whether MuJoCo Warp simulates on an NVIDIA GPU (the extra `gpu`); without, MuJoCo on CPU threads."""
    start: Name = "shipped"
    """A policy that comes along (`shipped`, `randomised`, `imu`), `nothing`, or a policy's folder to go on from."""
    learner: Literal["ppo", "world_model"] | None = None
    """`ppo`, or `world_model`, which learns through a model of the robot; None: PPO on a CPU, the other on a GPU."""
    held_out: PartOf = 0.15
    """Share of the motions that the policy does not train on, by a hash of their names, in families of 4 or more."""
    worlds: Annotated[int, Range(least=1, most=1_000_000)] | None = None
    """Copies of the robot; None: 512 on a CPU, 4,096 on a GPU."""
    threads: Few = 2
    """CPU threads of the physics."""
    seed: Seed = 0
    """Seed of the network and of all draws."""


@dataclass(frozen=True, eq=False)
class Trained:
    """The outcome of a training."""

    folder: Path
    """Folder with policy.pt, policy.onnx, contract.json, card.json, README.md, curve.csv, trials.csv and film.gif."""
    policy: "Policy"
    """The policy that was kept: the trained one, or the one it began from where training made it no better."""
    trials: "pd.DataFrame"
    """Trials of the kept policy, a row a motion, as `evaluate` returns them."""
    dropped: "pd.DataFrame"
    """Motions that the filter dropped: `motion`, `rule`, `explanation` ..."""
    no_better: bool
    """Whether training did not improve success on the training motions, so that `policy` is the one it began from."""

    def __repr__(self) -> str:
        """One line: where, how many motions it follows, and which policy was kept."""
        followed = f"{int(self.trials['success'].sum())} of {len(self.trials)} motions followed"
        return f"<policy in {self.folder}: {followed}{'; the initial policy was kept' if self.no_better else ''}>"


def train(
    motions: Clip | Sequence[Clip],
    out: str | Path,
    *,
    overwrite: bool = False,
    say: Callable[[str], None] = lambda text: None,
    **settings: Any,
) -> Trained:
    """Train a policy that follows motions with the G1's whole body.

    Motions that break a kinematic rule are dropped, some are held out. A training that was killed goes on from its last
    checkpoint when it is called again with the same arguments.

    Args:
        motions: motions at 50 Hz, as `read_motions` returns them; cut long ones there (`max_seconds=10`).
        out: a new folder for the policy.
        overwrite: replace a policy that an earlier call wrote there.
        say: called with a line for each step.
        **settings: fields of `bumblebee.api.training.TrainConfig`, such as `minutes=15`, `gpu=True`,
            `start="nothing"`.

    Returns:
        The policy, its folder, how well it follows each motion, and what the filter dropped.

    Raises:
        BadInput: no usable motion, a setting out of its range, no GPU, or a place that cannot be written.

    Examples:
        >>> import bumblebee as bb
        >>> motions = bb.read_motions("embedded", families=("stand",), limit=1)
        >>> made = bb.train(motions, "policy", minutes=0.02, worlds=16)
        >>> (made.folder / "policy.onnx").exists()
        True
    """
    from bumblebee.api.learnt import learnt_before
    from bumblebee.motion.filters.rules import filter_clips
    from bumblebee.motion.pieces import hold_out, too_few
    from bumblebee.report.wording import plural

    config, out = _config(settings), Path(out).expanduser()
    require_ready(config, out, overwrite)
    known, clips = learnt_before(config.start), checks.motions(motions)
    kept, dropped = filter_clips(clips)
    if not kept:
        first = dropped.iloc[0]
        came = f"none of {len(clips)}; the first: {first['motion']}: {first['explanation']}"
        raise BadInput("motions", "a motion that the robot can do", came)
    split = hold_out(kept, config.held_out)
    held = sum(clip.split == "test" for clip in split)
    say(f"{plural(len(split), 'motion')}, {held} of them held out; {len(clips) - len(kept)} dropped by the filter")
    if config.held_out and not held:
        say(f"none is held out, so the trials show no motion that is new to the policy: {too_few(split)}")
    with _checkpoints(out, split, config, say) as folder:
        learner = make_learner(split, config, folder)
        train_for(learner, 60 * config.minutes)
        say(f"trained on {learner.frames:,} control steps; trying the policy on each motion")
        return _kept(learner, split, config, out, dropped, known, say)


def require_ready(config: TrainConfig, out: Path, overwrite: bool) -> None:
    """`BadInput` for what would end a training later: a place that is taken or cannot be written, a GPU's absence."""
    refuse_foreign(out, lambda path: (path / CARD).exists(), "a policy")
    if (out / CARD).exists() and not overwrite:
        do = "--overwrite (in Python `overwrite=True`) replaces it."
        raise BadInput(out, "a new folder", "a policy whose training is finished", do)
    try_output(out)
    if config.gpu:
        from bumblebee.sim.warp_limits import warp_modules

        warp_modules("cuda")


def make_learner(clips: Sequence[Clip], config: TrainConfig, folder: Path) -> "Learner":
    """The learner of `config` around the task on the training clips; it goes on from a checkpoint in `folder`."""
    import torch

    from bumblebee.api.recipes import algorithm, as_seen_by, task
    from bumblebee.learning import learners
    from bumblebee.learning.policy import load_policy
    from bumblebee.sim.engine_choice import make_engine
    from bumblebee.tracking.env import TrackingEnv
    from bumblebee.tracking.model import task_model
    from bumblebee.tracking.sampling.library import MotionLibrary

    torch.set_num_threads(config.threads)
    own, parent = task(config.gpu, config.threads), parent_of(config.start)
    own = own if config.worlds is None else replace(own, num_worlds=config.worlds)
    started = None if parent is None else load_policy(parent)
    own = own if started is None else as_seen_by(own, started.shape)
    engine = make_engine(own.engine, task_model(own), own.num_worlds, own.threads, buffers=own.buffers)
    settings = algorithm(config.learner or ("world_model" if config.gpu else "ppo"), config.gpu, started)
    trained_on, _ = learners.played(settings, [clip for clip in clips if clip.split == "train"])
    env = TrackingEnv(MotionLibrary(trained_on, own.ahead, device=engine.device), engine, own, config.seed)
    return learners.make_learner(settings, env, folder, config.seed, parent)


def parent_of(start: str) -> Path | None:
    """Folder of the policy to start from; None for nothing."""
    from bumblebee.learning import pretrained

    return None if start == NOTHING else pretrained.SHIPPED.get(start) or Path(start).expanduser()


def train_for(learner: "Learner", seconds: float) -> None:
    """Train until `seconds` of training are done in all, those before a kill included; the curriculum follows the time.

    The first iterations measure the speed, from which the length of the schedules follows.
    A checkpoint comes each minute at the latest.
    """
    begin, marks, saved = learner.iteration, [], learner._seconds
    learner.limit = seconds

    def aim(since: tuple[int, float]) -> None:
        each = (learner._seconds - since[1]) / (learner.iteration - since[0])
        left = max(round((seconds - learner._seconds) / each), 1)
        learner.config = replace(learner.config, iterations=learner.iteration + left)

    def save_now_and_then() -> None:
        nonlocal saved
        if learner._seconds - saved >= _CHECKPOINT:
            learner.save_checkpoint()
            saved = learner._seconds

    def measured() -> bool:
        save_now_and_then()
        marks.append((learner.iteration, learner._seconds))
        if len(marks) > 2:  # the first interval has the loading of kernels in it
            aim(marks[-2])
        return learner.iteration >= begin + _FIRST or learner._seconds >= seconds

    def enough() -> bool:
        save_now_and_then()
        aim(since)
        return learner._seconds >= seconds

    learner.config = replace(learner.config, iterations=begin + 100 * _FIRST)
    learner.train("speed", measured)
    since = marks[-2:][0]
    while learner._seconds < seconds:  # once, unless it grows faster than it was measured
        aim(since)
        learner.train("policy", enough)
    learner.save_checkpoint()


@contextlib.contextmanager
def _checkpoints(out: Path, clips: Sequence[Clip], config: TrainConfig, say: Callable[[str], None]) -> Iterator[Path]:
    """A folder beside `out` that survives a kill and is emptied when motions or settings change; gone at the end."""
    from bumblebee.learning.learner import CHECKPOINT

    made_of = hashlib.sha256(repr(replace(config, minutes=1.0)).encode())
    for clip in clips:
        made_of.update(repr((clip.name, clip.split, clip.joint_pos.shape)).encode())
        made_of.update(clip.joint_pos.tobytes() + clip.root_pos.tobytes() + clip.root_quat.tobytes())
    key = made_of.hexdigest()[:16]
    place = out.absolute().with_name(f".{out.name}.training")
    for old in place.glob("*"):
        if old.name != key:
            shutil.rmtree(old, ignore_errors=True)
    (place / key).mkdir(parents=True, exist_ok=True)
    try:
        yield place / key
    except (KeyboardInterrupt, Stopped):
        kept = f"the last checkpoint is kept in {place}; the same command goes on from it"
        say(kept if (place / key / CHECKPOINT).exists() else "no checkpoint yet; the same command begins anew")
        raise
    shutil.rmtree(place)


def _kept(
    learner: "Learner",
    clips: Sequence[Clip],
    config: TrainConfig,
    out: Path,
    dropped: "pd.DataFrame",
    known: Sequence[str],
    say: Callable[[str], None],
) -> Trained:
    """Try the policy and the one it began from, keep the better, write its folder."""
    from bumblebee.api.policies import evaluate, follow, load_policy
    from bumblebee.api.policy_card import card_of, readme
    from bumblebee.learning.export import CONTRACT, export_policy
    from bumblebee.learning.learner import CURVE
    from bumblebee.report.films.playback import write_pictures

    policy, parent = learner.policy(), parent_of(config.start)
    after = evaluate(policy, clips, threads=config.threads)
    before = None if parent is None else evaluate(parent, clips, threads=config.threads)
    if before is not None and _score(after) < _score(before):
        say("training did not improve success on the training motions: the initial policy is kept")
        policy, kept = load_policy(str(parent)), before  # type: ignore[assignment]
    else:
        kept = after
    card = card_of(learner, clips, asdict(config), before, after, kept is before, known)
    shown = next((clip for clip in clips if clip.split == "test"), clips[0])
    with new_folder(out) as folder:
        policy.save(folder)
        export_policy(folder, policy, learner.env.cfg.physics_hz)
        shutil.copy(learner.folder / CURVE, folder / CURVE)
        kept.to_csv(folder / "trials.csv", index=False)
        (folder / CARD).write_text(json.dumps(card, indent=1) + "\n")
        contract = json.loads((folder / CONTRACT).read_text())
        (folder / "README.md").write_text(readme(card, contract, kept))
        write_pictures(folder / "film.gif", follow(policy, shown))
    return Trained(out, policy, kept, dropped, kept is before)


def _score(trials: "pd.DataFrame") -> tuple[float, float]:
    """Success on the training motions, then accuracy: what decides which policy is kept."""
    own = trials[trials["split"] == "train"]
    return float(own["success"].mean()), -float(own["key_error"].mean())


def _config(settings: dict[str, Any]) -> TrainConfig:
    for name in settings:
        if name not in TrainConfig.__dataclass_fields__:
            raise BadInput("train", f"a setting among {', '.join(TrainConfig.__dataclass_fields__)}", repr(name))
    return TrainConfig(**settings)
