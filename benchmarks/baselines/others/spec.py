"""Parts of a baseline: the task, the algorithm, the student, the reward, and when an episode is lost."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import torch
from torch import Tensor

from benchmarks.baselines.others.scoring import Scoring
from bumblebee.learning.config import PpoConfig
from bumblebee.sim.engine import RobotState
from bumblebee.sim.rotations import rotate_inverse
from bumblebee.tracking.config import EnvConfig, ObservationConfig
from bumblebee.tracking.sampling.library import ReferenceFrame

Lost = Callable[[RobotState, ReferenceFrame], Tensor]
"""Which robots (B,) bool have lost their episode, apart from the threshold on key bodies."""

TILT = 0.7
"""Part of gravity along the base's x or y beyond which OmniH2O and HOVER give an episode up."""


@dataclass(frozen=True)
class StudentConfig:
    """How a student is distilled from its teacher: DAgger on its own steps, all of them and nothing older."""

    steps: int = 1
    """Control steps of each world before an update."""
    epochs: int = 1
    """Passes over those steps."""
    mini_batches: int = 1
    """Gradient steps a pass."""
    learning_rate: float = 5e-4
    """Adam's rate."""
    grad_norm: float = 0.2
    """Gradients are scaled down to this norm."""
    hidden: tuple[int, ...] = (512, 256, 128)
    """Widths of the student's layers, ELU."""
    loss: Literal["norm", "mse"] = "norm"
    """Mean norm of the difference of the actions, or its mean square."""


@dataclass(frozen=True)
class Baseline:
    """One group's policy on our robot."""

    name: str
    env: EnvConfig
    """The task; its observation is the teacher's, its reward's weights are not used."""
    ppo: PpoConfig
    """How the teacher is trained."""
    student: StudentConfig
    """How the student is distilled."""
    scoring: Scoring
    """The reward."""
    lost: Lost
    """When an episode is lost, beside the threshold."""
    scale: float = 0.25
    """Factor [rad] on the actions of all joints, around the relaxed stand."""
    tried: ObservationConfig | None = None
    """Observation of the student in trials, if that is not what it saw in training."""


def tilted(state: RobotState, ref: ReferenceFrame) -> Tensor:
    """Robots (B,) bool that lean so far that gravity's part along the base's x or y exceeds 0.7."""
    down = torch.zeros_like(state.root_pos_w)
    down[:, 2] = -1.0
    return (rotate_inverse(state.root_quat_w, down)[:, :2].abs() > TILT).any(-1)
