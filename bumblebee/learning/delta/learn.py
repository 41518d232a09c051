"""Learns a delta action by the method that its settings name."""

from collections.abc import Callable

import pandas as pd
from torch import Tensor

from bumblebee.learning.delta import regression
from bumblebee.learning.delta.action import DeltaAction, DeltaConfig
from bumblebee.learning.delta.env import DeltaEnv
from bumblebee.learning.delta.recordings import Recordings
from bumblebee.learning.delta.train import train_delta
from bumblebee.sim.engine import Engine


def learn_delta(
    engine: Engine,
    recordings: Recordings,
    config: DeltaConfig,
    encoder_offset: Tensor,
    report: Callable[[int, str], None] = lambda frames, note: None,
) -> tuple[DeltaAction, pd.DataFrame]:
    """A delta action and how it was learnt, a row a pass or an iteration; see `fit_delta` and `train_delta`.

    Args:
        engine: the simulator that is corrected, of `config.num_envs` worlds.
        recordings: training rollouts only.
        config: see `DeltaConfig`.
        encoder_offset: (J,) [rad] what the encoders add, taken off a recording before it becomes a state.
        report: called with control steps of all robots since the last call, and a short note.

    Raises:
        BadInput: if PPO learns it and no recording is as long as an episode.
    """
    if config.method == "regression":
        return regression.fit_delta(engine, recordings, config, encoder_offset, report)
    return train_delta(DeltaEnv(engine, recordings, config, encoder_offset), config, report)


def total_frames(config: DeltaConfig) -> int:
    """Control steps of all robots that `learn_delta` takes at most."""
    if config.method == "regression":
        return regression.frames(config)
    return config.iterations * config.steps_per_iteration * config.num_envs
