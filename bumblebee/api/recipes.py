"""Settings of a training by machine and start: what `train` uses where the caller says nothing else."""

from dataclasses import replace
from typing import Literal

from bumblebee.learning.config import PpoConfig
from bumblebee.learning.policy import Policy, Shape
from bumblebee.learning.world_model.config import WorldModelConfig
from bumblebee.tracking.config import EnvConfig
from bumblebee.tracking.observing.needs import needed
from bumblebee.tracking.observing.terms import expanded

GENTLE = PpoConfig(learning_rate=1e-4, learning_rate_range=(1e-5, 1e-3), desired_kl=0.01, desired_kl_end=0.01)
"""PPO from a policy that can follow motions already: higher rates make it forget (docs/training-studies.md)."""
FROM_NOTHING = PpoConfig(
    epochs=5,
    hidden=(512, 256, 128),
    gamma=0.98,
    entropy=0.003,
    learning_rate_range=(1e-5, 2e-3),
    desired_kl=0.02,
    desired_kl_end=0.01,
    symmetry=True,
)
"""PPO from nothing, as the shipped policy was trained (its README)."""


VALUE_FIRST = 20
"""Iterations of PPO in which the value alone learns, where a policy comes without a critic."""


def task(gpu: bool, threads: int) -> EnvConfig:
    """The task with the shipped policy's observation: on CPU threads, or on an NVIDIA GPU as it was trained."""
    if not gpu:
        return EnvConfig(threads=threads)
    drawn = {"sampler_stretch": 1.0, "sampler_memory": 0.98, "sampler_floor": 0.1}
    shrinks = {"threshold_end": 0.35, "threshold_share": 0.4}
    return EnvConfig(engine="mujoco_warp", num_worlds=4096, physics_hz=200.0, **drawn, **shrinks)  # type: ignore[arg-type]


def as_seen_by(task: EnvConfig, shape: Shape) -> EnvConfig:
    """The task for a policy of this shape; one that cannot know its place is compared in the robot's own place."""
    knows = "place" in needed(expanded((*shape.terms, *shape.now)), shape.actions, len(shape.ahead))
    place: Literal["world", "own"] = "world" if knows else "own"
    return replace(task, observation=shape.seen, ahead=shape.ahead, action=shape.action, place=place)


def algorithm(learner: str, gpu: bool, parent: Policy | None) -> PpoConfig | WorldModelConfig:
    """Settings of the learner of that name, by machine and the policy that it starts from."""
    if learner == "world_model":
        return WorldModelConfig(compile=gpu, symmetry=True)
    if parent is not None:
        return GENTLE if parent.critic_state else replace(GENTLE, value_first=VALUE_FIRST)
    return FROM_NOTHING if gpu else replace(PpoConfig(), symmetry=True)
