"""Stage control: what the same training brings without the diagnosis: -> models/control/r<round>/<cluster>/<kind>.

The expert that `refine` trains on in the corrected model is trained on with the same settings, seed and number of steps
in the declared model (`declared`), and in the declared model with a delta action that was trained on it (`delta`, as
ASAP does, whether or not it beats none). What refinement gains beyond these is what the diagnosis was worth.
"""

from collections.abc import Callable
from pathlib import Path

import torch

from bumblebee.learning.delta import DeltaConfig, action_adapter, save_delta
from bumblebee.learning.trial import World
from bumblebee.sim.engine import RobotState
from bumblebee.sim.sensors import load_model
from bumblebee.tracking.observing.observations import action_scale
from tasks.delta import card, declared, train
from tasks.policies.training import Job, cluster_clips, train_policy
from tasks.refine import RefineConfig
from tasks.running import paths
from tasks.running.stage import load, output_folder, run_stage
from tasks.sections import parent_of
from tasks.settings.control_config import ControlConfig

Adapter = Callable[[RobotState, torch.Tensor, torch.Tensor], torch.Tensor]


def main(round: int, cluster: str, kind: str) -> None:
    """Fill models/control/r<round>/<cluster>/<kind>."""
    load("control", ControlConfig)
    config = load("refine", RefineConfig)
    out = paths.control(round, cluster, kind)
    adapter = delta_alone(round, cluster, out / "action") if kind == "delta" else None
    clips, share, tried = cluster_clips(cluster, config.others)
    job = Job(
        stage="control",
        name=f"control-{kind}-{cluster}-r{round}",
        out=out / "policy",
        clips=clips,
        tried=tried,
        world=World(load_model(physics_hz=config.env.physics_hz), None, adapter, config.env.threads),
        share=share,
        parent=paths.expert(parent_of(round), cluster),
        cluster=cluster,
        round=round,
        better_of=False,
    )
    train_policy(job, config)


def delta_alone(round: int, cluster: str, target: Path) -> Adapter | None:
    """The delta action of the declared model, used whatever it is worth; None without rollouts to learn it from."""
    config = load("delta", DeltaConfig)
    trained = train(declared(round), round, cluster, config)
    if trained is None:
        print(f"round {round}, {cluster}: no rollout is long enough for a delta action: this control has none")
        return None
    with output_folder(target) as folder:
        save_delta(folder, trained.delta, card(trained, round, cluster, config))
    return action_adapter(trained.delta, action_scale())


if __name__ == "__main__":
    run_stage(main)
