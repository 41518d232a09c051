"""profiles/paper.yaml has the figures of the paper's appendices A to D, typed off here; stages take its sections."""

import json
import subprocess
import sys
from functools import reduce
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
import yaml

from bumblebee.evaluation.contract import Thresholds
from bumblebee.learning.delta.rewards import closeness
from bumblebee.robot.facts import ANKLE_JOINTS, joint_names
from bumblebee.tracking.rewards import PAPER_SHARPNESS, PAPER_WEIGHTS
from flows.environment import environment
from flows.stages import read_stages
from flows.workspace import HOME, create, merge
from tasks.sections import check_content
from tasks.settings import params

FILE = HOME / "profiles" / "paper.yaml"
TRACKING = {
    # Appendix A, observation and termination; B, randomisation and the batch; "flat, rough".
    "env.observation.history": 5,
    "env.threshold_end": 0.3,
    "env.reward.preset": "paper",
    "env.reward.weights": {},
    "env.reward.sharpness": {},
    "env.num_worlds": 4096,
    "env.physics_hz": 200.0,
    "env.randomisation.friction": (0.5, 1.25),
    "env.randomisation.base_com": 0.1,
    "env.randomisation.mass": 0.2,
    "env.randomisation.gains": 0.25,
    "env.randomisation.delay": (0.020, 0.040),
    "env.randomisation.push_interval": 10.0,
    "env.randomisation.push": 0.5,
    "env.randomisation.push_regular": True,
    "env.terrain.rough": 0.5,
}
PPO = {
    # Appendix B, hyperparameters for PPO; C, MLP.
    "ppo.schedule": "fixed",
    "ppo.learning_rate": 1e-4,
    "ppo.gamma": 0.99,
    "ppo.clip": 0.2,
    "ppo.entropy": 0.001,
    "ppo.grad_norm": 1.0,
    "ppo.epochs": 5,
    "ppo.mini_batches": 4,
    "ppo.value": 1.0,
    "ppo.hidden": (1024, 1024, 512),
}
APPENDIX: dict[str, dict[str, Any]] = {
    "base": {**PPO, **TRACKING, "env.threshold_start": 0.8},
    "experts": {**PPO, **TRACKING},
    "refine": {**PPO, **TRACKING},
    "rollouts": {"motions": 20, "repeats": 8},  # B, delta action
    "filter": {"policy.source": "shipped"},  # section 2: what a policy cannot follow is left out
    "cluster": {"method": "autoencoder"},
    "delta": {
        **PPO,
        "method": "ppo",
        "engine": "mujoco_warp",
        "num_envs": 4096,
        "joints": ANKLE_JOINTS,
        "action_penalty": 1.0,
        # B, reward design for the delta action.
        "rewards.torque_limits": -10.0,
        "rewards.dof_pos_limits": -10.0,
        "rewards.dof_vel_limits": -10.0,
        "rewards.termination": -200.0,
        "rewards.dof_acc": -3e-8,
        "rewards.action_rate": -2.0,
        "rewards.action_norm": -2.0,
        "rewards.torque": -1e-4,
        "rewards.root_pos": 1.0,
        "rewards.root_rot": 0.5,
        "rewards.root_ang_vel": 0.5,
        "rewards.root_vel": 0.5,
        "rewards.dof_pos": 0.5,
        "rewards.dof_vel": 0.5,
    },
    "distill": {
        # Appendix A, observation of the student; B, hyperparameters for DAgger; C, transformer.
        "env.student.history": 10,
        "learning_rate": 1e-4,
        "grad_norm": 1.0,
        "epochs": 2,
        "mini_batches": 4,
        "env.num_worlds": 4096,
        "steps": 1,
        "model": "transformer",
        "init": "scratch",
        "transformer.heads": 6,
        "transformer.feed_forward": 128,
        "transformer.head": (128,),
        "transformer.embedding": 204,
        "transformer.memory": 10,
    },
}
FIGURES = [(section, key, value) for section, table in APPENDIX.items() for key, value in table.items()]


@pytest.fixture(scope="module")
def content() -> dict[str, Any]:
    return merge(params.read(HOME / "params.yaml"), params.read(FILE))


@pytest.fixture(scope="module")
def sections(content: dict[str, Any]) -> dict[str, Any]:
    """Each section as its stage gets it."""
    made = {}
    for name in APPENDIX:
        module, _, kind = params.SECTIONS[name].partition(":")
        made[name] = params.section_of(content, name, getattr(import_module(module), kind), FILE)
    return made


def test_every_section_is_taken(content: dict[str, Any]) -> None:
    check_content(content, FILE)


@pytest.mark.parametrize(("section", "key", "value"), FIGURES)
def test_a_figure_is_the_appendices(section: str, key: str, value: Any, sections: dict[str, Any]) -> None:
    assert reduce(getattr, key.split("."), sections[section]) == value


def test_the_rounds_and_clusters_are_the_papers(content: dict[str, Any], sections: dict[str, Any]) -> None:
    assert len(content["clusters"]) == 6 and content["final_round"] == 2
    assert content["rounds"] == [{"n": 1, "parent": 0}, {"n": 2, "parent": 1}]
    assert sections["base"].init == "scratch"
    assert sections["experts"].others == sections["refine"].others == 0.0


def test_the_rewards_of_the_tracking_policy_are_the_tables() -> None:
    assert {
        **dict.fromkeys(("torque_limits", "dof_position_limits", "dof_velocity_limits"), -10.0),
        "dof_acceleration": -3e-8,
        **dict.fromkeys(("action_rate", "action_smoothness", "feet_orientation"), -2.0),
        "torque": -0.0001,
        "stumble": -0.00125,
        "body_position": 1.0,
        **dict.fromkeys(("root_rotation", "root_angular_velocity", "root_velocity"), 0.5),
        **dict.fromkeys(("dof_position", "dof_velocity"), 0.5),
    } == PAPER_WEIGHTS
    assert set(PAPER_SHARPNESS.values()) == {4.0}


def test_the_delta_actions_task_rewards_are_the_tables() -> None:
    """exp(-4 |x - x_ref|^2)."""
    import torch

    assert float(closeness(torch.tensor([[0.3, 0.4]]), torch.zeros(1, 2))) == pytest.approx(2.718281828**-1.0)
    assert len(ANKLE_JOINTS) == 4 and len(joint_names()) == 23


def test_a_policy_is_tested_by_the_papers_thresholds() -> None:
    assert (Thresholds().walking, Thresholds().other) == (0.8, 0.4)


def test_the_head_says_what_is_open_what_differs_and_what_does_not_learn() -> None:
    """Whatever a section states and the appendices do not is named there."""
    head = FILE.read_text().split("\n\n", 1)[0]
    for words in (
        "What the paper leaves open is ours:",
        "What differs from its text:",
        "What does not learn as printed:",
    ):
        assert words in head
    for named in (
        "GAE's lambda",
        "H2O's limit",
        "TMR",
        "first deviation",
        "own last action",
        "action norm",
        "limit of",
    ):
        assert named in head, named


def tiny() -> dict[str, Any]:
    """Budgets of profiles/smoke.yaml and less, on the processor; all else is the paper's."""
    learner = {"num_worlds": 8, "physics_hz": 100, "threads": 1, "engine": "mujoco"}
    ppo = {"iterations": 2, "steps": 8, "epochs": 1, "mini_batches": 1, "hidden": [32, 32]}
    smoke = params.read(HOME / "profiles" / "smoke.yaml")
    return merge(
        smoke,
        {
            **{name: {"env": learner, "ppo": ppo} for name in ("base", "experts", "refine")},
            "cluster": {"hidden": 32, "layers": 1, "heads": 2, "latent": 16, "max_steps": 20, "threads": 1},
            "rollouts": {"motions": 4, "repeats": 1},
            "diagnose": {"search_seconds": 1.0, "beyond_seconds": 1.0, "max_windows": 12},
            "delta": {"engine": "mujoco", "num_envs": 8, "ppo": {**ppo, "iterations": 1}},
            "distill": {"env": learner, "iterations": 2, "capacity": 1000},
        },
    )


@pytest.mark.slow
def test_both_rounds_run_to_the_report(tmp_path: Path) -> None:
    """Filter by a policy, elbow, PPO from nothing, delta actions by PPO, two rounds, the transformer; tiny budgets."""
    folder = create(tmp_path / "paper", "paper")
    settings = merge(params.read(folder / "params.yaml"), tiny())
    (folder / "params.yaml").write_text(yaml.safe_dump(settings))
    assert [row["n"] for row in settings["rounds"]] == [1, 2] and settings["delta"]["method"] == "ppo"
    ran = subprocess.run(
        [sys.executable, "-m", "dvc", "repro"],
        cwd=folder, env=environment(folder), capture_output=True, text=True, timeout=1800, check=False,
    )  # fmt: skip
    assert ran.returncode == 0, ran.stdout[-3000:] + ran.stderr[-3000:]
    lock = yaml.safe_load((folder / "dvc.lock").read_text())["stages"]
    assert set(lock) == {stage.name for stage in read_stages(folder)}
    assert {"refine@after1-c0", "refine@after1-c1", "control@after1-c0-declared"} <= set(lock)
    cards = [json.loads(file.read_text()) for file in sorted(folder.glob("models/delta/r*/c*/card.json"))]
    assert len(cards) == 4 and {tuple(card["network"]["joints"]) for card in cards} == {ANKLE_JOINTS}
    assert json.loads((folder / "data" / "published.json").read_text())["models"]["generalist"]
    assert (folder / "reports" / "report.html").stat().st_size > 10_000
