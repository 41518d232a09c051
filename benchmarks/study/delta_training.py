"""Trains a delta action on rollouts of a robot, and replays rollouts in a corrected simulator."""

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import mujoco
import numpy as np
import torch

from benchmarks.study.correction import Correction
from bumblebee.io.write import new_folder
from bumblebee.learning.delta import (
    DeltaConfig,
    Recordings,
    learn_delta,
    load_delta,
    magnitudes,
    recorded_state,
    replay_error,
    save_delta,
    stack,
)
from bumblebee.measured.rollout import Rollout
from bumblebee.sim.engine_choice import make_engine
from bumblebee.sim.sensors import load_model


def write_delta(
    rollouts: Sequence[Rollout], engine: str, config: DeltaConfig, correction: Correction, folder: Path
) -> None:
    """Write a delta action on what a correction leaves of the rollouts, with its card and curve, into a new folder.

    Args:
        rollouts: what it learns from.
        engine: name of the simulator.
        config: the training.
        correction: of the declared model, without a delta action.
        folder: where.
    """
    model = load_model(correction.model)
    learned = stack(rollouts, load_model())
    simulator = make_engine(engine, model, config.num_envs, 1, correction.hooks(model))
    trained, curve = learn_delta(simulator, learned, config, encoder_offset(correction, model))
    sizes = magnitudes(trained, recorded_state(learned), learned.targets)
    card = {"promoted": False, "magnitude_rad": sizes, "rollouts": len(learned.ids), "config": asdict(config)}
    with new_folder(folder) as new:
        save_delta(new, trained, card)
        curve.to_csv(new / "curve.csv", index=False)


def replayed(correction: Correction, recordings: Recordings, worlds: int) -> dict[str, np.ndarray]:
    """Horizon -> error of each rollout in a corrected simulator, on the processor, `worlds` windows at once."""
    model = load_model(correction.model)
    engine = make_engine("mujoco", model, worlds, 1, correction.hooks(model))
    adapter = load_delta(correction.delta, promoted_only=False) if correction.delta else None
    return replay_error(engine, recordings, encoder_offset(correction, model), adapter)


def encoder_offset(correction: Correction, model: mujoco.MjModel) -> torch.Tensor:
    """(J,) what the encoders of the corrected robot add [rad]."""
    hooks = correction.hooks(model)
    if hooks is None:
        return torch.zeros(model.nu)
    return torch.as_tensor(hooks.encoder_offset, dtype=torch.float32)
