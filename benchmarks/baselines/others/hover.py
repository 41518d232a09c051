"""HOVER: one student for many ways of being commanded, by masks over one command (He et al., 2024).

Weights, kernels and settings of the public code, NVlabs/HOVER (`reward_cfg.py`, `teacher_policy_cfg.py`,
`student_policy_trainer_cfg.py`, `mask.py`, `neural_wbc_env_cfg_h1.py`); docs/baselines.md has the table and what was
adapted. The teacher observes what OmniH2O's does.
"""

from dataclasses import replace

from benchmarks.baselines.others import h2o_rows as rows
from benchmarks.baselines.others.omnih2o import POSITIVE, PPO, PROPRIOCEPTION, ROWS, TEACHER
from benchmarks.baselines.others.omnih2o import WEIGHTS as OMNIH2O_WEIGHTS
from benchmarks.baselines.others.scoring import Curriculum, Scoring
from benchmarks.baselines.others.spec import Baseline, StudentConfig, tilted
from bumblebee.tracking.config import EnvConfig, ObservationConfig
from bumblebee.tracking.presets import PAPER_RANDOMISATION
from bumblebee.tracking.rewards import RewardConfig

NAME = "hover"
COMMAND = ("hover_command", "hover_mask")
"""Terms that tell the student its command in training: a masked command and its mask."""
COMMAND_TRIED = ("hover_command_all", "hover_mask_all")
"""Terms that tell the student its command in trials: all of the command, as the paper compares it."""
WEIGHTS = {name: weight for name, weight in OMNIH2O_WEIGHTS.items() if name != "body_rotation"} | {"stumble": -1000.0}


def scoring() -> Scoring:
    """OmniH2O's rows without the rotation, other kernels for joint speed and foot force, all punishments scaled."""
    kept = {name: row for name, row in ROWS.items() if name in WEIGHTS}
    own = {"joint_velocity": rows.joint_velocity(1.0), "feet_contact_forces": rows.feet_contact_forces(600.0)}
    scaled = tuple(name for name in WEIGHTS if name not in POSITIVE)
    return Scoring(kept | own, WEIGHTS, Curriculum(start=0.5, least=0.0, long=125.0, degree=1e-4, rows=scaled))


def hover() -> Baseline:
    """The policy with all its settings."""
    env = EnvConfig(
        action="default",
        observation=ObservationConfig(terms=TEACHER),
        student=ObservationConfig(terms=PROPRIOCEPTION, history=25, now=COMMAND, noise=0.0),
        reward=RewardConfig(soft_limit=0.85),
        randomisation=PAPER_RANDOMISATION,
        threshold_start=0.5,
        threshold_end=0.5,
    )
    student = StudentConfig(steps=1, epochs=1, mini_batches=1, learning_rate=5e-4, grad_norm=0.2, loss="norm")
    tried = replace(env.student, now=COMMAND_TRIED)
    return Baseline(NAME, env, PPO, student, scoring(), lost=tilted, tried=tried)
