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
    """A delta action and how it was learnt, a row a pass or an iteration; see `fit_delta`, for the arguments too.

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
    return config.ppo.iterations * config.ppo.steps * config.num_envs
