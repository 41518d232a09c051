"""The delta action: a small policy that corrects the simulator where it still errs; its task, training and worth."""

from bumblebee.learning.delta.action import (
    CARD,
    DELTA_PPO,
    DeltaAction,
    DeltaConfig,
    RegressionConfig,
    action_adapter,
    load_delta,
    magnitudes,
    make_network,
    save_delta,
)
from bumblebee.learning.delta.by_cluster import of_clusters
from bumblebee.learning.delta.env import DeltaEnv
from bumblebee.learning.delta.gain import Gain, by_rollout, compare, replay_error, state_error
from bumblebee.learning.delta.learn import learn_delta, total_frames
from bumblebee.learning.delta.recordings import Recordings, recorded_state, stack
from bumblebee.learning.delta.regression import fit_delta
from bumblebee.learning.delta.train import train_delta

__all__ = [
    "CARD",
    "DELTA_PPO",
    "DeltaAction",
    "DeltaConfig",
    "DeltaEnv",
    "Gain",
    "Recordings",
    "RegressionConfig",
    "action_adapter",
    "by_rollout",
    "compare",
    "fit_delta",
    "learn_delta",
    "load_delta",
    "magnitudes",
    "make_network",
    "of_clusters",
    "recorded_state",
    "replay_error",
    "save_delta",
    "stack",
    "state_error",
    "total_frames",
    "train_delta",
]
