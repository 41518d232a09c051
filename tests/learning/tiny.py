"""Tiny tasks for the tests of learning."""

from collections.abc import Sequence

from bumblebee.learning.generalist.teacher_student import make_env
from bumblebee.motion.clip import Clip
from bumblebee.tracking.config import EnvConfig
from bumblebee.tracking.env import TrackingEnv
from tests.tracking.clips import waving

CLIPS = [waving("a", 50), waving("b", 70, speed=0.3)]


def env_of(task: EnvConfig, clips: Sequence[Clip] = CLIPS, seed: int = 0) -> TrackingEnv:
    """The task on two clips."""
    return make_env(clips, task, seed)
