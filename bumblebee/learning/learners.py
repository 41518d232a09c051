"""The learners there are: which one a name in the settings, and its section, stand for."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Literal

from bumblebee.learning.config import PpoConfig
from bumblebee.learning.learner import Learner
from bumblebee.learning.ppo.learner import Trainer
from bumblebee.learning.ranks import Ranks
from bumblebee.learning.world_model.config import WorldModelConfig
from bumblebee.learning.world_model.trainer import WorldModelTrainer
from bumblebee.motion.clip import Clip
from bumblebee.tracking.env import TrackingEnv
from bumblebee.tracking.sampling.reflection import with_reflections
from bumblebee.tracking.sampling.sampler import ClipShares

Name = Literal["ppo", "world_model"]
Config = PpoConfig | WorldModelConfig
_LEARNERS: dict[type, Callable[..., Learner]] = {PpoConfig: Trainer, WorldModelConfig: WorldModelTrainer}


def played(
    config: Config, clips: Sequence[Clip], share: ClipShares | None = None
) -> tuple[list[Clip], ClipShares | None]:
    """Clips that a learner's worlds play, and how often: PPO reflects samples instead, as it learns from them."""
    if isinstance(config, WorldModelConfig) and config.symmetry:
        return with_reflections(clips, share)
    return list(clips), share


def make_learner(
    config: Config,
    env: TrackingEnv,
    folder: Path,
    seed: int = 0,
    parent: Path | None = None,
    ranks: Ranks | None = None,
) -> Learner:
    """The learner that these are the settings of, around `env`; a checkpoint in `folder` is continued.

    Args:
        config: the algorithm.
        env: the task.
        folder: for the checkpoint and the curve.
        seed: of the networks and the noise.
        parent: folder of a policy to start from, if any.
        ranks: the processes that train this policy together.
    """
    return _LEARNERS[type(config)](env, config, folder, seed, parent, ranks)
