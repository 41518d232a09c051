"""Settings that a run of the method fixes beforehand."""

from dataclasses import dataclass, field, replace

from benchmarks.baselines.methods import OURS
from bumblebee.diagnosis.config import DiagnosisConfig
from bumblebee.learning.config import PpoConfig
from bumblebee.learning.delta import DeltaConfig, RegressionConfig
from bumblebee.learning.learners import Config
from bumblebee.learning.world_model.config import WorldModelConfig
from bumblebee.stand_in.process import BASES
from bumblebee.tracking.config import EnvConfig
from bumblebee.tracking.presets import PAPER_RANDOMISATION

TASK = EnvConfig(
    engine="mujoco_warp",
    num_worlds=4096,
    physics_hz=200.0,
    randomisation=PAPER_RANDOMISATION,
    sampler_stretch=1.0,
    sampler_memory=0.98,
    sampler_floor=0.1,
    threshold_end=0.35,
    threshold_share=0.4,
)
"""The task of docs/training.md, "Levels", with the paper's randomisation."""


@dataclass(frozen=True)
class Distilling:
    """Settings that all students share."""

    iterations: int = 4000
    worlds: int = 4096
    steps: int = 2
    """Control steps of each world an iteration."""
    rate: float = 3e-4
    """Adam's."""
    capacity: int = 10_000_000
    """Samples that are kept."""
    margin: float = 0.05
    """Nothing reads it since the first study left; it is in the hash of the settings that pages of results name."""


@dataclass(frozen=True)
class Method:
    """Learner, budgets and robots' recordings, the same for every row."""

    seed: int = 0
    env: EnvConfig = field(default_factory=lambda: TASK)
    base: Config = field(
        default_factory=lambda: WorldModelConfig(iterations=1000, hidden=(512, 256, 128), symmetry=True, compile=True)
    )
    """Learner of the base policy, on all training motions."""
    child: Config = field(
        default_factory=lambda: WorldModelConfig(hidden=(512, 256, 128), symmetry=True, policy_rate=2e-4)
    )
    """Learner of what goes on from it; its iterations are those below."""
    child_threshold: float = 0.35
    """Distance that ends an episode of what goes on from the base policy, from its first step on [m]."""
    expert: int = 100
    """Iterations of an expert."""
    refine: int = 75
    """Iterations of an expert in a round."""
    rounds: int = 2
    motions: int = 20
    """Motions of each cluster that a round records, all where it has fewer: half to learn from, half to judge by."""
    repeats: int = 8
    """Recordings of each motion."""
    max_seconds: float = 8.0
    """Longer motions are cut to their beginning on a robot [s]."""
    shards: int = 6
    """Processes that record or try side by side."""
    record_base: str = BASES[2]
    """Source of the base's place in a recording."""
    tried_base: str = BASES[1]
    """Source of the base's place for the robot while it is tried."""
    record_seed: int = 51_100
    """Seed of start states and sensor noise; a round has seeds of its own."""
    delta: DeltaConfig = field(default_factory=lambda: DeltaConfig(regression=RegressionConfig(windows=2000)))
    """By regression, as in the demo."""
    diagnosis: DiagnosisConfig = field(
        default_factory=lambda: DiagnosisConfig(search_seconds=150.0, beyond_seconds=30.0)
    )
    judge_worlds: int = 64
    """Robots that replay recordings at once."""
    distil: Distilling = field(default_factory=lambda: Distilling(iterations=2000))

    def spent(self, clusters: int) -> int:
        """Iterations of all experts together, all rounds included."""
        return clusters * (self.expert + self.rounds * self.refine)


BY_PPO = Method(
    env=replace(TASK, num_worlds=8192),
    base=replace(OURS, symmetry=True, iterations=700),
    child=replace(OURS, symmetry=True, learning_rate=3e-4),
    expert=60,
    refine=60,
)
"""The paper's learner, with the settings that it learns by here."""
_HASTY = DiagnosisConfig(
    max_windows=12, max_holdout_windows=8, report_windows=8, search_seconds=1.0, beyond_seconds=1.0
)
_TINY = WorldModelConfig(
    iterations=2,
    memory=12,
    window=4,
    horizon=4,
    model_updates=1,
    policy_updates=1,
    model_batch=16,
    policy_batch=16,
    model_hidden=(32, 32),
    hidden=(32, 32),
    warm_up=1,
    symmetry=True,
)
SMALL = Method(
    env=replace(TASK, engine="mujoco", num_worlds=16, physics_hz=100.0, threads=1),
    base=_TINY,
    child=_TINY,
    expert=1,
    refine=1,
    motions=2,
    repeats=1,
    max_seconds=1.2,
    shards=1,
    delta=DeltaConfig(num_envs=8, regression=RegressionConfig(windows=100)),
    diagnosis=_HASTY,
    judge_worlds=8,
    distil=Distilling(iterations=3, worlds=8, steps=4, capacity=4000),
)
"""In seconds on two cores: it shows that every step runs, and nothing else."""
NAMED = {"world_model": Method(), "ppo": BY_PPO, "small": SMALL}


def chosen(name: str, seed: int) -> Method:
    """The settings of that name, with a seed."""
    return replace(NAMED[name], seed=seed)


def iterations(config: Config, count: int) -> Config:
    """The learner's settings with so many iterations."""
    assert isinstance(config, PpoConfig | WorldModelConfig)
    return replace(config, iterations=count)
