"""profiles/paper.yaml has the figures of the paper's appendices, and sections that the stages take."""

from dataclasses import replace
from typing import Any

import pytest

from bumblebee.learning.config import PAPER
from bumblebee.learning.distill import PAPER_DAGGER, DistillConfig
from bumblebee.learning.transformer import TransformerConfig
from bumblebee.sim.warp_limits import Buffers
from bumblebee.tracking.presets import PAPER_TASK, STUDENT
from flows.workspace import HOME, merge
from tasks import params
from tasks.base import BaseConfig
from tasks.experts import ExpertsConfig
from tasks.refine import RefineConfig
from tasks.rollouts_config import RolloutsConfig
from tasks.sections import check_content

FILE = HOME / "profiles" / "paper.yaml"


@pytest.fixture(scope="module")
def content() -> dict[str, Any]:
    return merge(params.read(HOME / "params.yaml"), params.read(FILE))


def test_every_section_is_taken(content: dict[str, Any]) -> None:
    check_content(content, FILE)


def own(content: dict[str, Any], name: str, kind: type) -> Any:
    return params.section_of(content, name, kind, FILE)


def test_teachers_learn_the_papers_task_by_its_algorithm(content: dict[str, Any]) -> None:
    task = replace(PAPER_TASK, buffers=Buffers(64, 256))
    base = own(content, "base", BaseConfig)
    assert base.init == "scratch" and base.env == task
    for name, kind in (("base", BaseConfig), ("experts", ExpertsConfig), ("refine", RefineConfig)):
        section = own(content, name, kind)
        said = ("steps", "epochs", "mini_batches", "gamma", "clip", "entropy", "grad_norm", "schedule", "hidden")
        for field in (*said, "learning_rate", "initial_std"):
            assert getattr(section.ppo, field) == getattr(PAPER, field), (name, field)
        assert section.env == (task if name == "base" else replace(task, threshold_start=0.3))
        assert name == "base" or section.others == 0.0


def test_the_student_is_the_papers_transformer_by_its_dagger(content: dict[str, Any]) -> None:
    section = own(content, "distill", DistillConfig)
    for field in ("steps", "epochs", "mini_batches", "learning_rate", "grad_norm", "init"):
        assert getattr(section, field) == getattr(PAPER_DAGGER, field), field
    assert (section.model, section.transformer, section.env.student) == ("transformer", TransformerConfig(), STUDENT)
    assert section.env.num_worlds * section.steps == 4096  # the paper's batch


def test_rounds_and_recordings_are_the_papers(content: dict[str, Any]) -> None:
    rollouts = own(content, "rollouts", RolloutsConfig)
    assert (rollouts.motions, rollouts.repeats, content["final_round"], len(content["clusters"])) == (20, 8, 2, 6)
    assert content["rounds"] == [{"n": 1, "parent": 0}, {"n": 2, "parent": 1}]
