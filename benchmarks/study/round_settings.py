"""Settings that the rounds fix beforehand, and which of them the command line chooses."""

import argparse
from dataclasses import dataclass, field, replace

from benchmarks.study.settings import SMALL, Study
from bumblebee.deploy.stand_in import BASES
from bumblebee.diagnosis.config import DiagnosisConfig
from bumblebee.learning.delta import DELTA_PPO, DeltaConfig


@dataclass(frozen=True)
class RoundsConfig:
    """Settings that the rounds fix beforehand."""

    rounds: int = 2
    motions: int = 20
    """That are recorded, equally many of each cluster: half to learn the correction from, half to judge it by."""
    repeats: int = 8
    """Recordings of each motion."""
    max_seconds: float = 8.0
    """Longer motions are cut to their beginning [s]."""
    tries: int = 2
    """Trials of each motion after a round, of those recorded and of those held out from all training."""
    shards: int = 4
    """Processes that record or try side by side."""
    steps: float = 10e6
    """Control steps by which each arm trains on in a round."""
    record_base: str = BASES[2]
    """Source of the base's place in a recording."""
    tried_base: str = BASES[1]
    """Source of the base's place for the robot while it is tried and recorded."""
    record_seed: int = 18_100
    """Seed of start states and sensor noise; a round has seeds of its own, and so have trials."""
    try_seed: int = 18_900
    delta: DeltaConfig = field(
        default_factory=lambda: DeltaConfig(
            method="ppo", limit=0.2, num_envs=1024, ppo=replace(DELTA_PPO, iterations=300)
        )
    )
    diagnosis: DiagnosisConfig = field(default_factory=DiagnosisConfig)
    """Settings of the first round's diagnosis, before a GPU is there."""
    later: DiagnosisConfig = field(default_factory=lambda: DiagnosisConfig(search_seconds=150.0, beyond_seconds=30.0))
    """Settings of later rounds' diagnoses, which GPUs wait for: less time, on all cores."""
    judge_worlds: int = 64
    """Robots that replay held-out recordings at once."""


_HASTY = DiagnosisConfig(
    max_windows=12, max_holdout_windows=8, report_windows=8, search_seconds=1.0, beyond_seconds=1.0
)
REGRESSION = RoundsConfig(rounds=1, delta=DeltaConfig(), diagnosis=RoundsConfig().later)
"""One round with delta actions by regression, on the processor; its diagnosis takes no longer than a later one."""
SMALL_CONFIG = RoundsConfig(
    motions=4,
    repeats=1,
    max_seconds=1.2,
    tries=1,
    shards=1,
    steps=512,
    delta=DeltaConfig(
        method="ppo", limit=0.2, num_envs=8, ppo=replace(DELTA_PPO, iterations=1, steps=4), episode_seconds=0.4
    ),
    diagnosis=_HASTY,
    later=_HASTY,
)
"""For tests: it shows that every step runs, and nothing else."""


def settings(options: argparse.Namespace) -> tuple[Study, RoundsConfig]:
    """Settings of the study and of its rounds, by the command line."""
    if options.small:
        return SMALL, SMALL_CONFIG
    return Study(), REGRESSION if options.regression else RoundsConfig()


def add_settings(parser: argparse.ArgumentParser) -> None:
    """The options that `settings` reads."""
    own = parser.add_mutually_exclusive_group()
    own.add_argument("--small", action="store_true", help="the same in seconds on two cores: shows that it runs")
    own.add_argument("--regression", action="store_true", help="one round, with delta actions by regression")
