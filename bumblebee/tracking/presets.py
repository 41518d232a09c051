"""The paper's task as settings (appendices A and B); every other default is the demo's."""

from dataclasses import replace
from typing import Any

from bumblebee.tracking.config import EnvConfig, ObservationConfig, Randomisation, RewardConfig, Terrain

PAPER_RANDOMISATION = Randomisation(
    friction=(0.5, 1.25),
    gains=0.25,
    mass=0.2,
    base_com=0.1,
    delay=(0.020, 0.040),
    push=0.5,
    push_interval=10.0,
    push_regular=True,
)
"""Appendix B, table of domain randomisation; the terrain's row is `PAPER_TASK.terrain`."""

TEACHER = ObservationConfig(terms=("teacher",), history=5, noise=0.0)
"""Appendix A: the privileged observation over 5 control steps."""

STUDENT = ObservationConfig(terms=("student",), history=10)
"""Appendix A: what the robot can sense, over 10 control steps."""

PAPER_TASK = EnvConfig(
    engine="mujoco_warp",
    num_worlds=4096,
    physics_hz=200.0,
    ahead=(),
    observation_noise=0.0,
    observation=TEACHER,
    action="default",
    reward=RewardConfig(preset="paper"),
    randomisation=PAPER_RANDOMISATION,
    terrain=Terrain(rough=0.5),
    threshold_start=0.8,
    threshold_end=0.3,
)
"""The teacher's task. No sensor noise: the paper lists none. Physics at the 200 Hz of its low-level interface."""


def distillation_task(task: EnvConfig, student: ObservationConfig = STUDENT, **changes: Any) -> EnvConfig:
    """The task of a teacher with a student beside it, who sees `student`; `changes` are of any other field."""
    return replace(task, student=student, **changes)
