"""Train the base policy on all training clips: data/filtered -> models/base (paper, section 3.2)."""

from dataclasses import dataclass
from typing import Literal

from bumblebee.learning import pretrained
from bumblebee.learning.trial import World
from bumblebee.sim.sensors import load_model
from tasks.policies.training import Job, TrainingConfig, train_policy, training_clips
from tasks.running import paths
from tasks.running.stage import load, run_stage


@dataclass(frozen=True)
class BaseConfig(TrainingConfig):
    """The training of the base policy."""

    init: Literal["pretrained", "randomised", "own", "scratch"] = "pretrained"
    """Go on from a policy that comes with BumbleBee, or from your own in data/policy (`make demo POLICY=`), with its
    layers, or from nothing. The pretrained one has seen the embedded library's training clips and real motions
    (bumblebee/learning/pretrained/README.md); the randomised one real motions on robots that differ, with delays
    (pretrained/randomised/README.md)."""

    def __post_init__(self) -> None:
        """Refuse a policy from nothing that nobody trains."""
        super().__post_init__()
        self.require(self.init != "scratch" or self.learner != "none", "learner", "ppo or world_model from scratch")


def main() -> None:
    """Fill models/base."""
    config = load("base", BaseConfig)
    clips = training_clips()
    world = World(load_model(physics_hz=config.env.physics_hz), threads=config.env.threads)
    own = [clip for clip in clips if clip.split == "train"]
    begun = {"pretrained": pretrained.FOLDER, "randomised": pretrained.RANDOMISED, "own": paths.POLICY}
    parent = begun.get(config.init)
    train_policy(Job("base", "base", paths.BASE, own, clips, world, parent=parent), config)


if __name__ == "__main__":
    run_stage(main)
