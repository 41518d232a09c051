"""Who learns in a distillation: from base or from nothing, with a memory or without."""

from collections.abc import Mapping
from dataclasses import replace

import torch
from rsl_rl.models import MLPModel

from bumblebee.learning.generalist.config import DistillConfig
from bumblebee.learning.policy import Policy, Shape, new_actor, shape_of
from bumblebee.tracking.env import TrackingEnv


def group_of(env: TrackingEnv) -> str:
    """The observations of who learns."""
    return "student" if "student" in env.groups else "policy"


def new_student(
    env: TrackingEnv, experts: Mapping[int, Policy], config: DistillConfig, base: Policy | None
) -> tuple[MLPModel, Shape]:
    """Who learns, on the environment's device, and its shape.

    From nothing it has the experts' mean deviation at first. With base's observation it keeps base's normalisation.
    """
    own = config.transformer if config.model == "transformer" else None
    hidden = tuple(config.hidden) if own is None else own.head
    alike = base is not None and group_of(env) == "policy"
    if base is not None and alike and config.init == "base":
        student, shape = new_actor(base.shape), base.shape
        student.load_state_dict(base.actor.state_dict())
    else:
        like = base.shape if base is not None and alike else shape_of(env, hidden, group_of(env))
        shape = replace(like, hidden=hidden, transformer=own)
        student = new_actor(shape)
        sharp = [expert.actor.distribution.std_param.detach().cpu() for expert in experts.values()]
        student.distribution.std_param.data.copy_(torch.stack(sharp).mean(0))
    student.train()
    if base is not None and alike:
        student.obs_normalizer.load_state_dict(base.actor.obs_normalizer.state_dict())
        student.obs_normalizer.eval()  # the statistics stay those of base's training
    return student.to(env.device), shape
