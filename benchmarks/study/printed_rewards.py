"""Reward of a step under the paper's printed terms: to the reference itself, and to a policy that follows it.

    python -m benchmarks.study.printed_rewards study/run/s0-base --motions study/motions --out rewards.md

Nothing is trained. Each piece of motion is followed once from its first frame, without noise, until it is lost; actions
count in the paper's unit, joint targets around the stand by `action_scale`. "The reference" is a robot that is where
the reference is at every step and commands what holds the next frame: without error, contact or torque.
"""

import argparse
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import mujoco
import pandas as pd
import torch
from torch import Tensor

from benchmarks.study.jobs import job_of
from benchmarks.study.motions import Motions, read_motions
from benchmarks.study.others import manner
from benchmarks.study.pages.tables import cell, estimate, head, line
from bumblebee.errors import EXIT_BAD_INPUT, BadInput
from bumblebee.learning.policy import Policy, load_policy
from bumblebee.learning.rollout import Manner
from bumblebee.motion.clip import Clip
from bumblebee.sim.engine import Engine
from bumblebee.sim.engine_choice import make_engine
from bumblebee.tracking.config import EnvConfig, RewardConfig
from bumblebee.tracking.model import task_model
from bumblebee.tracking.observing.groups import Group
from bumblebee.tracking.observing.observations import action_middle, action_scale, joint_targets
from bumblebee.tracking.rewards import ERRORS, Limits, Reward, Step
from bumblebee.tracking.rows import Rows
from bumblebee.tracking.sampling.library import MotionLibrary, ReferenceFrame
from bumblebee.tracking.sampling.starts import start_state
from bumblebee.tracking.terminations import fallen, success_threshold

PRINTED = RewardConfig(preset="paper")
PHYSICS_HZ = 200.0
_AT_ONCE = 64
Mover = Callable[[Engine, int, ReferenceFrame], Tensor]
"""(engine, frame, reference one step ahead) -> targets (B, J) [rad] that were commanded; moves the engine one step."""


@torch.inference_mode()
def earned(
    clips: Sequence[Clip], library: MotionLibrary, engine: Engine, move: Mover, rewards: RewardConfig = PRINTED
) -> pd.DataFrame:
    """A row a clip: its name, frames until it was lost, and each term's mean over them, weighted, before the period."""
    n, dt, scale, stand = len(clips), engine.control_dt, action_scale(), action_middle("default")
    ids, reward, limits = torch.arange(n), Reward(rewards, engine.control_dt), Limits.of_robot(rewards.soft_limit)
    reward.progress(1.0)
    first = library.frames(ids, torch.zeros(n))
    engine.reset(ids, *start_state(first, 0.0, torch.Generator()), first.hold_pos)
    engine.settle()
    assert stand is not None  # "default" has one
    still = (first.hold_pos - stand) / scale
    actions, speed = (still, still, still), engine.state().joint_vel
    running, limit = torch.ones(n, dtype=torch.bool), torch.tensor([success_threshold(c) for c in clips])
    counts, sums = torch.zeros(n), {}
    for frame in range(int(library.length.max()) - 1):
        ref = library.frames(ids, torch.full((n,), (frame + 1) * dt))
        actions = ((move(engine, frame, ref) - stand) / scale, *actions[:2])
        state = engine.state()
        step = Step(
            state=state,
            ref=ref,
            torque=engine.torque(),
            joint_acc=(state.joint_vel - speed) / dt,
            actions=actions,
            foot_force_w=engine.foot_force_w(),
            foot_quat_w=engine.foot_quat_w(),
            limits=limits,
        )
        speed = state.joint_vel
        lost = (step.key_errors.amax(-1) > limit) | fallen(state, ref) | engine.unstable()
        running &= ~lost & (frame + 1 < library.length)
        counts += running
        for name, value in reward.terms(step).items():
            sums[name] = sums.get(name, torch.zeros(n)) + torch.where(running, value, 0.0)
        if not running.any():
            break
    means = {name: (total / counts).numpy() for name, total in sums.items()}
    table = pd.DataFrame({"name": [clip.name for clip in clips], "frames": counts.numpy(), **means})
    return table[table["frames"] > 0]


def on_reference(engine: Engine, frame: int, ref: ReferenceFrame) -> Tensor:
    """Put the robots where the reference is; what holds it is what they commanded."""
    engine.reset(torch.arange(engine.num_worlds), *start_state(ref, 0.0, torch.Generator()), ref.hold_pos)
    engine.settle()
    return ref.hold_pos


def by_policy(policy: Policy, how: Manner, worlds: int, library: MotionLibrary) -> Mover:
    """Motion under a policy without noise."""
    group = Group(how.seen, (worlds, library.num_joints, len(library.ahead)), 0.0, torch.device("cpu"))
    scale = action_scale() if how.scale is None else torch.full((library.num_joints,), how.scale)
    middle, act = action_middle(policy.shape.action), policy.follower()
    last, generator = [torch.zeros(worlds, library.num_joints)], torch.Generator().manual_seed(0)

    def move(engine: Engine, frame: int, ref: ReferenceFrame) -> Tensor:
        begins = Rows(torch.full((worlds,), frame == 0), by_mask=False)
        group.look(engine.state(), ref, last[0], begins, generator)
        last[0] = act(group.exact)
        targets = joint_targets(ref, last[0], scale, middle)
        engine.step(targets)
        return targets

    return move


def tried(folder: Path, motions: Motions) -> Iterator[tuple[str, pd.DataFrame]]:
    """The rows of the reference and of the policy in `folder`, all motions."""
    policy = load_policy(folder)
    how, model = manner(job_of(folder), policy), task_model(EnvConfig(physics_hz=PHYSICS_HZ))
    clips = [row.clip for row in motions.rows]
    for who in ("the reference", "the policy"):
        tables = []
        for first in range(0, len(clips), _AT_ONCE):
            part = clips[first : first + _AT_ONCE]
            library = MotionLibrary(part, policy.shape.ahead)
            move = on_reference if who == "the reference" else by_policy(policy, how, len(part), library)
            tables.append(earned(part, library, _engine(model, len(part)), move))
        yield who, pd.concat(tables, ignore_index=True)


def _engine(model: mujoco.MjModel, worlds: int) -> Engine:
    return make_engine("mujoco", model, worlds, 1)


def table(rows: dict[str, pd.DataFrame], motions: Motions) -> str:
    """Each term and the sum as Markdown, means over motions with bootstrapped intervals."""
    names = motions.labels[["name", "motion"]]
    told = {who: own.merge(names, on="name", validate="many_to_one") for who, own in rows.items()}
    terms = [c for c in next(iter(rows.values())).columns if c not in ("name", "frames")]
    lines = head(["reward of a second", *told])
    for term in terms:
        lines.append(line([term, *(cell(estimate(own, term), 2) for own in told.values())]))
    for label, some in (("punishing", [t for t in terms if t not in ERRORS]), ("task", list(ERRORS)), ("sum", terms)):
        sums = [own.assign(sum=own[some].sum(axis=1)) for own in told.values()]
        lines.append(line([f"**{label}**", *(cell(estimate(own, "sum"), 2) for own in sums)]))
    shares = [own.assign(less=(own[terms].sum(axis=1) < 0).astype(float)) for own in told.values()]
    lines.append(line(["share of pieces with a sum below 0", *(cell(estimate(own, "less"), 2) for own in shares)]))
    return "\n".join(lines) + "\n"


def main() -> None:
    """Write the table of one policy of a run."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("policy", type=Path, help="a policy's folder in a run")
    parser.add_argument("--motions", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    options = parser.parse_args()
    torch.set_num_threads(1)
    try:
        motions = read_motions(options.motions)
        options.out.write_text(table(dict(tried(options.policy, motions)), motions))
    except BadInput as error:
        print(error)
        raise SystemExit(EXIT_BAD_INPUT) from None


if __name__ == "__main__":
    main()
