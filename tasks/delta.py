"""Stage delta: one cluster's delta action on what the corrected model still misses, kept only if it beats none.

It is trained on the rollouts that the diagnosis fitted and judged on those that it held out: the delta never sees them.
"""

import math
from dataclasses import asdict, dataclass

import mujoco
import pandas as pd
import torch

from bumblebee.learning.delta import (
    DeltaAction,
    DeltaConfig,
    Gain,
    Recordings,
    compare,
    learn_delta,
    magnitudes,
    make_network,
    recorded_state,
    replay_error,
    save_delta,
    stack,
    total_frames,
)
from bumblebee.measured.rollout import read_dataset
from bumblebee.progress import progress
from bumblebee.sim.effects import RuntimeHooks, read_effects, runtime_hooks
from bumblebee.sim.engine import Engine
from bumblebee.sim.engine_choice import make_engine
from bumblebee.sim.sensors import load_model
from tasks.on_robot.diagnosis_split import split
from tasks.running import paths
from tasks.running.run_form import milliseconds
from tasks.running.stage import load, log_run, output_folder, run_stage

_WORLDS_TO_JUDGE = 64


@dataclass(frozen=True)
class Simulator:
    """Simulator that a delta action corrects."""

    model: mujoco.MjModel
    """With foot sensors."""
    hooks: RuntimeHooks
    """The effects that are no part of the model."""


@dataclass(frozen=True)
class Trained:
    """A delta action and what it is worth."""

    delta: DeltaAction
    curve: pd.DataFrame
    gain: Gain
    """On held-out rollouts, against no delta in the same simulator."""
    rollouts: tuple[str, ...]
    """Ids of those it was trained on."""
    magnitude_rad: dict[str, float]
    """Mean absolute correction of each joint."""


def main(round: int, cluster: str) -> None:
    """Fill models/delta/r<round>/<cluster>."""
    config = load("delta", DeltaConfig)
    trained = train(corrected(round), round, cluster, config)
    if trained is None:
        leave_out(round, cluster, config, f"no rollout to train on that lasts {config.episode_seconds:g} s")
        return
    target = paths.delta(round, cluster)
    with output_folder(target) as folder:
        save_delta(folder, trained.delta, card(trained, round, cluster, config))
        trained.curve.to_csv(folder / "curve.csv", index=False)
    gain = trained.gain
    print(verdict(round, cluster, gain))
    numbers: dict[str, dict[int, float]] = {}
    for horizon, values in gain.change.items():
        for name, value in values.items():
            if value == value:
                numbers.setdefault(f"held_out/{name}", {})[milliseconds(horizon)] = value
    tags = {"promoted": str(gain.promoted).lower()}
    curve = target / "curve.csv"
    log_run("delta", cluster=cluster, round=round, params=config, metrics=numbers, curve=curve, tags=tags)


def corrected(round: int) -> Simulator:
    """The simulator as the round's diagnosis describes the robot."""
    model = load_model(paths.corrected_model(round))
    return Simulator(model, runtime_hooks(read_effects(paths.effects(round)), model))


def declared(round: int) -> Simulator:
    """The simulator as the rollouts' maker declares the robot: no effect is known."""
    model = load_model(paths.measured(round) / "model.xml")
    return Simulator(model, runtime_hooks([], model))


def train(simulator: Simulator, round: int, cluster: str, config: DeltaConfig) -> Trained | None:
    """Train and judge the cluster's delta action; None where no rollout is long enough to train on."""
    offset = torch.as_tensor(simulator.hooks.encoder_offset, dtype=torch.float32)
    train, held_out = recordings(round, cluster)
    engine = make_engine(
        config.engine, simulator.model, config.num_envs, config.threads, simulator.hooks, config.buffers
    )
    steps = int(config.episode_seconds / engine.control_dt + 0.5)
    if train is None or len(train.windows(steps, 1)) == 0:
        return None
    with progress(total_frames(config), f"delta action, round {round}, {cluster}", "frames") as bar:
        delta, curve = learn_delta(engine, train, config, offset, bar.update)
    judge = make_engine("mujoco", simulator.model, _WORLDS_TO_JUDGE, config.threads, simulator.hooks)
    nothing = Gain(0, 0, {}, False, "no held-out rollouts")
    gain = judged(judge, held_out, offset, delta) if held_out is not None else nothing
    return Trained(delta, curve, gain, tuple(train.ids), magnitudes(delta, recorded_state(train), train.targets))


def card(trained: Trained, round: int, cluster: str, config: DeltaConfig) -> dict[str, object]:
    """Card of a delta action."""
    return {
        "round": round,
        "cluster": cluster,
        "promoted": trained.gain.promoted,
        "held_out": asdict(trained.gain),
        "train_rollouts": list(trained.rollouts),
        "magnitude_rad": trained.magnitude_rad,
        "config": asdict(config),
    }


def leave_out(round: int, cluster: str, config: DeltaConfig, reason: str) -> None:
    """A cluster without usable rollouts gets an untrained delta that is not kept; the other clusters go on."""
    gain = Gain(0, 0, {}, False, reason)
    delta = DeltaAction(make_network((), len(config.joints)), config.joints, config.limit)
    card = {"round": round, "cluster": cluster, "promoted": False, "held_out": asdict(gain), "train_rollouts": []}
    with output_folder(paths.delta(round, cluster)) as folder:
        save_delta(folder, delta, {**card, "magnitude_rad": {}, "config": asdict(config)})
    print(verdict(round, cluster, gain))
    log_run("delta", cluster=cluster, round=round, params=config, tags={"promoted": "false"})


def recordings(round: int, cluster: str) -> tuple[Recordings | None, Recordings | None]:
    """The cluster's rollouts of this round, as the diagnosis split them: to train on, to judge by; None without any.

    A rollout that names no cluster is nobody's: a delta corrects the simulator for one cluster's motions.
    """
    folder = paths.measured(round)
    declared = load_model(folder / "model.xml")
    train_ids, held_out_ids = split(round)
    everyones = read_dataset(folder).rollouts
    own = [r for r in everyones if r.meta.get("cluster") == cluster]
    if nameless := sum(not r.meta.get("cluster") for r in everyones):
        print(f"round {round}: {nameless} of {len(everyones)} rollouts name no cluster and train no delta action")
    train = [r for r in own if r.rollout_id in train_ids]
    held_out = [r for r in own if r.rollout_id in held_out_ids]
    return stack(train, declared) if train else None, stack(held_out, declared) if held_out else None


def judged(engine: Engine, held_out: Recordings, offset: torch.Tensor, delta: DeltaAction) -> Gain:
    """The held-out comparison with and without the delta."""
    without = replay_error(engine, held_out, offset, None)
    return compare(without, replay_error(engine, held_out, offset, delta), held_out.motions)


def verdict(round: int, cluster: str, gain: Gain) -> str:
    """One line for the terminal."""
    outcome = f"round {round}, {cluster}: delta action {'kept' if gain.promoted else 'not kept'}: {gain.reason}"
    if not gain.change:
        return outcome
    longest = list(gain.change.values())[-1]
    if not math.isfinite(longest["relative"]):
        return f"{outcome}; no held-out rollout reaches 1 s, so no error after it"
    rollouts = f"{_counted(gain.rollouts, 'held-out rollout')} of {_counted(gain.motions, 'motion')}"
    if not math.isfinite(longest["low"]):
        return f"{outcome}; error after 1 s {longest['relative']:+.1%}, no interval, on {rollouts}"
    ends = f"[{longest['low']:+.1%}, {longest['high']:+.1%}]"
    return f"{outcome}; error after 1 s {longest['relative']:+.1%} {ends} on {rollouts}"


def _counted(number: int, noun: str) -> str:
    return f"{number} {noun}{'' if number == 1 else 's'}"


if __name__ == "__main__":
    run_stage(main)
