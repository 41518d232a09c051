"""Refine an expert in the corrected simulator: -> models/experts/r<round>/<cluster> (paper, section 3.4).

The simulator is the round's corrected model, the effects that MJCF cannot hold, and the delta action if it was kept.
Where a round found nothing and kept no delta action there is nothing new to learn: the expert stays what it is.
"""

from dataclasses import dataclass, field

from bumblebee.learning.delta import action_adapter, load_delta
from bumblebee.learning.trial import World
from bumblebee.sim.effects import read_effects, runtime_hooks
from bumblebee.sim.sensors import load_model
from bumblebee.tracking.config import EnvConfig
from bumblebee.tracking.observing.observations import action_scale
from tasks.experts import ExpertsConfig
from tasks.policies.training import Job, cluster_clips, keep, train_policy
from tasks.running import paths
from tasks.running.stage import load, run_stage
from tasks.sections import parent_of


@dataclass(frozen=True)
class RefineConfig(ExpertsConfig):
    """The refinement of the experts."""

    env: EnvConfig = field(
        default_factory=lambda: EnvConfig(num_worlds=256, threads=1, threshold_start=0.4, physics_hz=200.0)
    )
    """The task; at 200 Hz, so that a delay of a few milliseconds is one."""


def main(round: int, cluster: str) -> None:
    """Fill models/experts/r<round>/<cluster>."""
    config = load("refine", RefineConfig)
    parent, out = paths.expert(parent_of(round), cluster), paths.expert(round, cluster)
    if not learned(round, cluster):
        print(f"round {round}, {cluster}: no effect was found: the expert is kept unchanged")
        keep("refine", parent, out, config, cluster, round)
        return
    clips, share, tried = cluster_clips(cluster, config.others)
    job = Job(
        stage="refine",
        name=f"expert-{cluster}-r{round}",
        out=out,
        clips=clips,
        tried=tried,
        world=corrected_world(round, cluster, config.env.physics_hz, config.env.threads),
        share=share,
        parent=parent,
        cluster=cluster,
        round=round,
        model=paths.corrected_model(round),
    )
    train_policy(job, config)


def learned(round: int, cluster: str) -> bool:
    """Whether the round changed the simulator: an effect was found, or the cluster's delta action was kept."""
    effects = read_effects(paths.effects(round))
    return bool(effects) or load_delta(paths.delta(round, cluster)) is not None


def corrected_world(round: int, cluster: str, physics_hz: float, threads: int) -> World:
    """The simulator as the round's diagnosis and delta action describe the robot."""
    model = load_model(paths.corrected_model(round), physics_hz)
    hooks = runtime_hooks(read_effects(paths.effects(round)), model)
    delta = load_delta(paths.delta(round, cluster))
    adapter = action_adapter(delta, action_scale()) if delta is not None else None
    return World(model, hooks, adapter, threads)


if __name__ == "__main__":
    run_stage(main)
