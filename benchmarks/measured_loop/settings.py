"""Settings that the four arms share, fixed beforehand; a run is held to it by `benchmarks.study.settings.freeze`."""

from dataclasses import dataclass, field

from bumblebee.diagnosis.config import DiagnosisConfig
from bumblebee.learning.policy import Policy
from bumblebee.learning.world_model.config import WorldModelConfig
from bumblebee.learning.world_model.residual import ResidualConfig
from bumblebee.stand_in.process import BASES
from bumblebee.tracking.config import EnvConfig, Randomisation
from tasks.seal import SealConfig

ARMS: dict[str, tuple[bool, bool]] = {
    "none": (False, False),
    "physics": (True, False),
    "residual": (False, True),
    "both": (True, True),
}
"""Arm -> whether its simulator has the effects found, and whether its model has a learned residual."""
ALIKE = Randomisation(friction=(1.0, 1.0), gains=0.0, mass=0.0, push=0.0)


@dataclass(frozen=True)
class Loop:
    """Robots, motions and budgets."""

    robots: tuple[int, ...] = (4601, 4602, 4603, 4604)
    """Seeds of the sealed robots. The last has one effect outside the catalogue, the others none."""
    effects: int = 3
    """Undeclared effects of a robot."""
    severity: float = 1.0
    loses: float = 0.2
    """Share of the trial's motions that the shipped policy must lose, see `SealConfig`; so the next."""
    stands: float = 1.5
    trial_motions: int = 10
    motions: int = 30
    """Embedded motions that are recorded: of six in a row, three to learn from, one to stop by, two to judge by."""
    seconds: float = 4.0
    """Longer motions are cut to their beginning [s]."""
    record_seed: int = 4_610
    try_seed: int = 4_690
    base: str = BASES[1]
    """How the robot knows its base's place: `mocap` or `odometry`."""
    env: EnvConfig = field(
        default_factory=lambda: EnvConfig(
            num_worlds=128, threads=1, physics_hz=200.0, threshold_start=0.4, randomisation=ALIKE
        )
    )
    """The task; observation and action are those of the shipped policy."""
    learner: WorldModelConfig = field(
        default_factory=lambda: WorldModelConfig(
            iterations=200, window=16, model_batch=256, policy_batch=512, model_hidden=(256, 256, 256), model_updates=8
        )
    )
    """Models and policies; `iterations` are those of an arm's policy."""
    part: int = 25
    """Iterations of a part of a model's training, after which a call may end."""
    parent_parts: int = 8
    """Parts of the parent's training in the declared simulator."""
    parts: int = 2
    """Parts by which each arm's model goes on, in the declared or in the corrected simulator."""
    residual: ResidualConfig = field(
        default_factory=lambda: ResidualConfig(window=20, batch=128, updates=800, check_every=40)
    )
    diagnosis: DiagnosisConfig = field(
        default_factory=lambda: DiagnosisConfig(search_seconds=45.0, beyond_seconds=15.0)
    )

    def sealed(self, index: int) -> SealConfig:
        """How a robot is drawn."""
        return SealConfig(
            seed=self.robots[index],
            n_effects=self.effects,
            outside=float(index == len(self.robots) - 1),
            severity=self.severity,
            loses=self.loses,
            stands=self.stands,
            motions=self.trial_motions,
            max_seconds=self.seconds,
            threads=1,
        )


def seen_by(task: EnvConfig, policy: Policy) -> dict[str, object]:
    """Fields of the task that a policy fixes."""
    return {"ahead": policy.shape.ahead, "observation": policy.shape.seen, "action": policy.shape.action}
