"""How well a policy follows clips: from the first frame to the last, deterministic, without noise."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import mujoco
import pandas as pd
import torch
from torch import Tensor

from bumblebee.learning.policy import Policy
from bumblebee.motion.clip import Clip
from bumblebee.ranges import Factor, Few, Ranged, Seed
from bumblebee.sim.effects import RuntimeHooks
from bumblebee.sim.engine_choice import make_engine
from bumblebee.tracking.config import ObservationConfig
from bumblebee.tracking.env import ActionAdapter
from bumblebee.tracking.groups import Group
from bumblebee.tracking.library import MotionLibrary
from bumblebee.tracking.observations import action_middle, action_scale, middle_targets
from bumblebee.tracking.rows import Rows
from bumblebee.tracking.starts import start_state
from bumblebee.tracking.terminations import fallen, key_distance, success_threshold

_WORLDS = 128  # at once


@dataclass(frozen=True)
class Trials(Ranged):
    """How often and how roughly a policy is tried; the same settings give the same starts and the same noise."""

    repeats: Few = 1
    """Rollouts of each clip."""
    noise: Factor = 0.0
    """Factor on the noise of the start and of the sensors."""
    seed: Seed = 0
    """Of that noise."""


@dataclass(frozen=True)
class World:
    """What the policy is tried on: a model with foot sensors, and what is no part of the model."""

    model: mujoco.MjModel
    hooks: RuntimeHooks | None = None
    action_adapter: ActionAdapter | None = None
    threads: int = 2


def try_policy(
    policy: Callable[[Tensor], Tensor],
    clips: Sequence[Clip],
    world: World,
    ahead: Sequence[float],
    trials: Trials | None = None,
) -> pd.DataFrame:
    """Roll out each clip, from its first frame.

    A `Policy` is shown what its shape says that it sees, and remembers each rollout from its start if it has a memory;
    any other function gets the demo's observation (N, D).

    Returns:
        a row a rollout: name, family, split, success, share (of the clip until it failed), key_error [m] and
        joint_error [rad] (means until then).
    """
    trials = trials or Trials()
    every = [clip for clip in clips for _ in range(trials.repeats)]
    tables = [_try_some(policy, every[i : i + _WORLDS], world, ahead, trials) for i in range(0, len(every), _WORLDS)]
    return pd.concat(tables, ignore_index=True)


def success_by_family(trials: pd.DataFrame) -> dict[str, float]:
    """Success rate of each family ("unknown" where a clip names none) and of `all`, rounded to three digits."""
    rates = {str(k) or "unknown": round(float(v), 3) for k, v in trials.groupby("family")["success"].mean().items()}
    return rates | {"all": round(float(trials["success"].mean()), 3)}


@torch.inference_mode()
def _try_some(
    policy: Callable[[Tensor], Tensor], clips: Sequence[Clip], world: World, ahead: Sequence[float], trials: Trials
) -> pd.DataFrame:
    n = len(clips)
    generator = torch.Generator().manual_seed(trials.seed)
    library = MotionLibrary(clips, ahead)
    engine = make_engine("mujoco", world.model, n, min(world.threads, n), world.hooks)
    ids, scale, dt = torch.arange(n), action_scale(), engine.control_dt
    shape = getattr(policy, "shape", None)
    act = policy.follower() if isinstance(policy, Policy) else policy
    seen, middle = (shape.seen, action_middle(shape.action)) if shape else (ObservationConfig(), None)
    group = Group(seen, (n, library.num_joints, len(library.ahead)), trials.noise, engine.device)
    limit = torch.tensor([success_threshold(clip) for clip in clips])
    first = library.frames(ids, torch.zeros(n))
    qpos, qvel = start_state(first, trials.noise, generator)
    engine.reset(ids, qpos, qvel, first.hold_pos)
    engine.settle()
    action = torch.zeros(n, library.num_joints)
    alive = torch.ones(n, dtype=torch.bool)
    survived, key_sum, joint_sum = torch.zeros(n), torch.zeros(n), torch.zeros(n)
    for frame in range(int(library.length.max()) - 1):
        ref = library.frames(ids, torch.full((n,), (frame + 1) * dt))
        state = engine.state()
        group.look(state, ref, action, Rows(torch.full((n,), frame == 0), by_mask=False), generator)
        action = act(group.noisy)
        zero, adapter = middle_targets(ref, middle), world.action_adapter
        motor = action if adapter is None else adapter(state, zero, action)
        engine.step(zero + scale * motor)
        state = engine.state()
        running = frame + 1 < library.length
        good = (key_distance(state, ref) <= limit) & ~fallen(state, ref) & ~engine.unstable()
        alive &= good | ~running
        counted = (alive & running).float()
        survived += counted
        key_sum += counted * torch.nan_to_num((state.key_pos_w - ref.key_pos_w).norm(dim=-1).mean(-1))
        joint_sum += counted * torch.nan_to_num((state.joint_pos - ref.joint_pos).abs().mean(-1))
        if not bool((alive & running).any()):
            break
    steps = survived.clamp(min=1)
    return pd.DataFrame(
        {
            "name": [clip.name for clip in clips],
            "family": [clip.family for clip in clips],
            "split": [clip.split for clip in clips],
            "success": alive.numpy(),
            "share": (survived / (library.length - 1).clamp(min=1)).numpy(),
            "key_error": (key_sum / steps).numpy(),
            "joint_error": (joint_sum / steps).numpy(),
        }
    )
