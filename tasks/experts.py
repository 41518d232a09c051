"""Fine-tune an expert from base on its cluster's clips: -> models/experts/r0/<cluster> (paper, section 3.2)."""

from dataclasses import dataclass, field

from bumblebee.learning.config import PpoConfig
from bumblebee.learning.trial import World
from bumblebee.ranges import PartOf
from bumblebee.sim.sensors import load_model
from bumblebee.tracking.config import EnvConfig
from tasks.policies.training import Job, TrainingConfig, cluster_clips, train_policy
from tasks.running import paths
from tasks.running.stage import load, run_stage


@dataclass(frozen=True)
class ExpertsConfig(TrainingConfig):
    """The fine-tuning of the experts."""

    env: EnvConfig = field(default_factory=lambda: EnvConfig(num_worlds=256, threads=1, threshold_start=0.4))
    """The task; one thread, since experts train side by side and threads that wait for each other lose then."""
    ppo: PpoConfig = field(default_factory=lambda: PpoConfig(iterations=80))
    """The algorithm."""
    others: PartOf = 0.1
    """Share of the draws that goes to other clusters' clips, so that an expert forgets nothing that it will need."""


def main(cluster: str) -> None:
    """Fill models/experts/r0/<cluster>."""
    config = load("experts", ExpertsConfig)
    clips, share, tried = cluster_clips(cluster, config.others)
    world = World(load_model(physics_hz=config.env.physics_hz), threads=config.env.threads)
    job = Job(
        stage="experts",
        name=f"expert-{cluster}-r0",
        out=paths.expert(0, cluster),
        clips=clips,
        tried=tried,
        world=world,
        share=share,
        parent=paths.BASE,
        cluster=cluster,
        round=0,
    )
    train_policy(job, config)


if __name__ == "__main__":
    run_stage(main)
