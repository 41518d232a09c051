"""How well a policy follows clips: from the first frame to the last, deterministic, without noise."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
import pandas as pd
import torch
from torch import Tensor

from bumblebee.learning.policy import Policy
from bumblebee.learning.rollout import Judge, Manner, roll_out
from bumblebee.motion.clip import Clip
from bumblebee.ranges import Factor, Few, Ranged, Seed
from bumblebee.sim.effects import RuntimeHooks
from bumblebee.sim.engine_choice import make_engine
from bumblebee.tracking.config import ObservationConfig
from bumblebee.tracking.env import ActionAdapter
from bumblebee.tracking.sampling.library import MotionLibrary

_WORLDS = 128  # at once


@dataclass(frozen=True)
class Trials(Ranged):
    """How often and how roughly a policy is tried; the same settings give the same starts and the same noise."""

    repeats: Few = 1
    """Rollouts of each clip."""
    noise: Factor = 0.0
    """Factor on the noise of the start and of the sensors."""
    seed: Seed = 0
    """Seed of that noise."""


@dataclass(frozen=True)
class World:
    """World that the policy is tried on: a model with foot sensors, and what is no part of the model."""

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
    keep: Callable[[Sequence[Clip], np.ndarray], None] | None = None,
) -> pd.DataFrame:
    """Roll out each clip, from its first frame.

    A `Policy` is shown what its shape says that it sees, and remembers each rollout from its start if it has a memory;
    any other function gets the demo's observation (N, D).

    Args:
        policy: what acts.
        clips: what it follows.
        world: where.
        ahead: look-ahead times [s] of the reference that it sees.
        trials: how often and how roughly.
        keep: called with N clips at a time and their robots' states (F, N, 30), to the end of the longest.

    Returns:
        a row a rollout: name, family, split, success, share (of the clip until it failed), key_error [m] and
        joint_error [rad] (means until then).
    """
    trials = trials or Trials()
    every = [clip for clip in clips for _ in range(trials.repeats)]
    tables = [
        _try_some(policy, every[i : i + _WORLDS], world, ahead, trials, keep) for i in range(0, len(every), _WORLDS)
    ]
    return pd.concat(tables, ignore_index=True)


def success_by_family(trials: pd.DataFrame) -> dict[str, float]:
    """Success rate of each family ("unknown" where a clip names none) and of `all`, rounded to three digits."""
    rates = {str(k) or "unknown": round(float(v), 3) for k, v in trials.groupby("family")["success"].mean().items()}
    return rates | {"all": round(float(trials["success"].mean()), 3)}


@torch.inference_mode()
def _try_some(
    policy: Callable[[Tensor], Tensor],
    clips: Sequence[Clip],
    world: World,
    ahead: Sequence[float],
    trials: Trials,
    keep: Callable[[Sequence[Clip], np.ndarray], None] | None,
) -> pd.DataFrame:
    library = MotionLibrary(clips, ahead)
    engine = make_engine("mujoco", world.model, len(clips), min(world.threads, len(clips)), world.hooks)
    seen = policy.shape.seen if isinstance(policy, Policy) else ObservationConfig()
    manner = Manner(seen, noise=trials.noise, adapter=world.action_adapter)
    judge, seen_states = Judge(clips), []
    for tick in roll_out(policy, manner, library, engine, torch.Generator().manual_seed(trials.seed)):
        going = judge.see(tick)
        if keep is not None:
            now = tick.state
            seen_states.append(torch.cat([now.root_pos_w, now.root_quat_w, now.joint_pos], dim=1).numpy())
        elif not bool(going.any()):
            break
    if keep is not None:
        keep(clips, np.stack(seen_states))
    return pd.DataFrame(
        {
            "name": [clip.name for clip in clips],
            "family": [clip.family for clip in clips],
            "split": [clip.split for clip in clips],
            "success": judge.kept.numpy(),
            "share": (judge.frames / (library.length - 1).clamp(min=1)).numpy(),
            "key_error": judge.key_error.numpy(),
            "joint_error": judge.joint_error.numpy(),
        }
    )
