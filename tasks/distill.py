"""Stage distill: the experts of the final round become one generalist, in the simulator of the last round."""

import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import mujoco
import pandas as pd

from bumblebee.errors import BadInput
from bumblebee.learning.delta import action_adapter, load_delta, of_clusters
from bumblebee.learning.export import export_policy
from bumblebee.learning.generalist.distill import DistillConfig, Distiller
from bumblebee.learning.policy import Policy, Shape, load_policy
from bumblebee.learning.trial import World, success_by_family, try_policy
from bumblebee.motion.clip import Clip
from bumblebee.motion.store import read_library
from bumblebee.progress import progress
from bumblebee.sim.effects import RuntimeHooks, read_effects, runtime_hooks
from bumblebee.sim.engine_choice import make_engine
from bumblebee.sim.sensors import load_model
from bumblebee.tracking.config import EnvConfig
from bumblebee.tracking.env import ActionAdapter, TrackingEnv
from bumblebee.tracking.model import task_model
from bumblebee.tracking.observing.observations import action_scale
from bumblebee.tracking.sampling.library import MotionLibrary
from bumblebee.tracking.sampling.sampler import ClipShares
from tasks.running import paths
from tasks.running.stage import load, log_run, output_folder, run_stage, scratch
from tasks.sections import loop


def main() -> None:
    """Fill models/generalist."""
    config, shape = load("distill", DistillConfig), loop()
    clips, cluster = training_clips(shape.clusters)
    base = load_policy(paths.BASE)
    folders = [paths.expert(shape.final_round, name) for name in shape.clusters]
    experts = {i: load_policy(folder) for i, folder in enumerate(folders)}
    check_task({paths.BASE: base.shape} | {folder: experts[i].shape for i, folder in enumerate(folders)}, config.env)
    model, hooks = simulator(shape.final_round, config.env.physics_hz)
    env = environment(clips, cluster, shape.final_round, hooks, config)
    env.action_adapter = deltas(env, cluster, shape.clusters, shape.final_round)
    kept = scratch("distill", paths.BASE, *folders, paths.FILTERED, paths.LABELS, config)
    distiller = Distiller(env, experts, cluster, config, base, kept)
    if distiller.iteration:
        print(f"generalist: goes on after iteration {distiller.iteration} of {config.iterations}", flush=True)
    total, begun = config.iterations * distiller.frames_each, distiller.iteration * distiller.frames_each
    with progress(total, "distil the generalist", "frames", start=begun) as bar:
        distiller.train(bar.update)
    generalist, curve = distiller.policy(), distiller.curve()
    card: dict[str, Any] = {
        "from": [f"expert-{name}-r{shape.final_round}" for name in shape.clusters],
        "agreement": agreement(generalist, clips, model, hooks, config),
        "parameters": sum(tensor.numel() for tensor in generalist.actor.parameters()),
        "samples_gib": round(distiller.gib, 3),
        "config": asdict(config),
    }
    with output_folder(paths.GENERALIST) as folder:
        generalist.save(folder)
        export_policy(folder, generalist, config.env.physics_hz)
        curve.to_csv(folder / "curve.csv", index=False)
        (folder / "card.json").write_text(json.dumps(card, indent=2) + "\n")
    final = {f"success/{k}": v for k, v in card["agreement"].items()}
    rate = card["agreement"]["all"]
    divergence = float(curve["kl"].iloc[-1])
    print(f"generalist: KL to the experts {divergence:.3f}, success in the corrected simulator {rate:.0%}")
    log_run("distill", params=config, metrics=final, curve=paths.GENERALIST / "curve.csv")


def training_clips(clusters: tuple[str, ...]) -> tuple[list[Clip], list[int]]:
    """The training clips and the index of each one's cluster."""
    labels = pd.read_parquet(paths.LABELS).set_index("name")["cluster"]
    clips = [clip for clip in read_library(paths.FILTERED) if clip.split == "train"]
    if not clips:
        raise BadInput(paths.FILTERED, "training clips", "none")
    return clips, [clusters.index(labels[clip.name]) for clip in clips]


def check_task(shapes: Mapping[Path, Shape], task: EnvConfig) -> None:
    """Refuse a policy that sees or means something else by its action than the task that the generalist learns in.

    Args:
        shapes: folder of each policy that teaches or starts -> its shape.
        task: `distill.env`.
    """
    seen = task.observation
    wanted = {
        "action": task.action,
        "ahead": tuple(task.ahead),
        "terms": tuple(seen.terms),
        "history": seen.history,
        "now": tuple(seen.now),
    }
    for folder, shape in shapes.items():
        for field, here in wanted.items():
            if (came := getattr(shape, field)) != here:
                do = "Give distill.env the experts' settings."
                raise BadInput(f"{folder}: {field}", f"{here!r} as in distill.env", repr(came), do)


def simulator(final_round: int, physics_hz: float) -> tuple[mujoco.MjModel, RuntimeHooks | None]:
    """The model that the last round corrected; the declared one if there was no round."""
    if final_round == 0:
        return load_model(physics_hz=physics_hz), None
    model = load_model(corrected(final_round), physics_hz)
    return model, runtime_hooks(read_effects(paths.effects(final_round)), model)


def corrected(final_round: int) -> Path | None:
    """MJCF of the robot as the last round corrected it; None before any round."""
    return paths.corrected_model(final_round) if final_round else None


def environment(
    clips: list[Clip], cluster: list[int], final_round: int, hooks: RuntimeHooks | None, config: DistillConfig
) -> TrackingEnv:
    """The tracking task over all clusters on the engine asked for, each cluster with the same share of the draws."""
    own = config.env
    model = task_model(own, corrected(final_round))
    engine = make_engine(own.engine, model, own.num_worlds, own.threads, hooks, own.buffers)
    library = MotionLibrary(clips, own.ahead, device=engine.device)
    return TrackingEnv(library, engine, own, config.seed, clip_share=ClipShares.equal(cluster))


def deltas(env: TrackingEnv, cluster: list[int], clusters: tuple[str, ...], final_round: int) -> ActionAdapter | None:
    """Each world's motion is run with the delta action that its cluster's expert was refined with, if any was kept."""
    if final_round == 0:
        return None
    kept = {i: load_delta(paths.delta(final_round, name)) for i, name in enumerate(clusters)}
    adapters = {i: action_adapter(delta, action_scale()) for i, delta in kept.items() if delta is not None}
    return of_clusters(env, cluster, adapters)


def agreement(
    generalist: Policy, clips: list[Clip], model: mujoco.MjModel, hooks: RuntimeHooks | None, config: DistillConfig
) -> dict[str, float]:
    """Success rate by family on the training clips, in the simulator it learned in, without any delta action."""
    world = World(model, hooks, threads=config.env.threads)
    return success_by_family(try_policy(generalist, clips, world, config.env.ahead))


if __name__ == "__main__":
    run_stage(main)
