"""Train the base policy on all training clips: data/filtered -> models/base (paper, section 3.2)."""

from pathlib import Path

from bumblebee.learning.trial import World
from bumblebee.sim.sensors import load_model
from tasks.stage import load, run_stage
from tasks.training import Job, TrainingConfig, train_policy, training_clips

BaseConfig = TrainingConfig


def main() -> None:
    """Fill models/base."""
    config = load("base", BaseConfig)
    clips = training_clips()
    world = World(load_model(physics_hz=config.env.physics_hz), threads=config.env.threads)
    own = [clip for clip in clips if clip.split == "train"]
    train_policy(Job("base", "base", Path("models/base"), own, clips, world), config)


if __name__ == "__main__":
    run_stage(main)
