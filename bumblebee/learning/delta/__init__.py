"""The delta action: a small policy that corrects the simulator where it still errs; its task, training and worth."""

from bumblebee.learning.delta.action import (
    CARD,
    DeltaAction,
    DeltaConfig,
    action_adapter,
    load_delta,
    magnitudes,
    make_network,
    save_delta,
)
from bumblebee.learning.delta.env import DeltaEnv
from bumblebee.learning.delta.gain import Gain, compare, replay_error
from bumblebee.learning.delta.recordings import Recordings, stack
from bumblebee.learning.delta.train import train_delta

__all__ = [
    "CARD",
    "DeltaAction",
    "DeltaConfig",
    "DeltaEnv",
    "Gain",
    "Recordings",
    "action_adapter",
    "compare",
    "load_delta",
    "magnitudes",
    "make_network",
    "replay_error",
    "save_delta",
    "stack",
    "train_delta",
]
