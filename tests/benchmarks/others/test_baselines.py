"""Each baseline trained for a moment: teacher, student, trial, and going on from a checkpoint."""

from dataclasses import replace
from pathlib import Path

import pytest
import torch

from benchmarks.baselines.others.dagger import Distiller, action_loss
from benchmarks.baselines.others.env import BaselineEnv
from benchmarks.baselines.others.follow import follow
from benchmarks.baselines.others.library import MovingLibrary
from benchmarks.baselines.others.registry import BASELINES, baseline
from benchmarks.baselines.others.spec import Baseline, tilted
from bumblebee.learning.policy import Policy, new_actor, shape_of
from bumblebee.learning.ppo.learner import Trainer
from bumblebee.learning.rollout import Manner
from bumblebee.learning.three_rules import key_errors
from bumblebee.motion.clip import differences
from bumblebee.motion.embedded import EmbeddedConfig, make_library
from bumblebee.sim.engine_choice import make_engine
from bumblebee.sim.rotations import from_rotation_vector
from bumblebee.sim.sensors import load_model
from bumblebee.tracking.model import task_model
from tests.benchmarks.others.steps import reference, state

CLIPS = make_library(EmbeddedConfig(limit=2))
WORLDS = 4


def small(name: str) -> Baseline:
    """The baseline on four worlds, with small networks."""
    own = baseline(name)
    env = replace(own.env, num_worlds=WORLDS, threads=1)
    student = replace(own.student, steps=min(own.student.steps, 2), hidden=(16,))
    return replace(own, env=env, ppo=replace(own.ppo, iterations=2, steps=4, hidden=(16,)), student=student)


def made(own: Baseline) -> BaselineEnv:
    engine = make_engine("mujoco", task_model(own.env), WORLDS, 1)
    return BaselineEnv(MovingLibrary(CLIPS, own.env.ahead), engine, own)


@pytest.mark.parametrize("name", BASELINES)
def test_a_teacher_and_its_student_learn_and_go_on(name: str, tmp_path: Path):
    own = small(name)
    env = made(own)
    trainer = Trainer(env, own.ppo, tmp_path)
    trainer.train()
    trainer.save_checkpoint()
    again = Trainer(made(own), own.ppo, tmp_path)
    assert again.iteration == 2
    here, there = env.state_dict(), again.env.state_dict()
    assert all(torch.equal(here[key], there[key]) for key in here if key.startswith("score_"))
    before = Distiller(env, trainer.policy(), own.student, tmp_path)
    start = before.policy()
    before.train(lambda: before.iteration >= 3, every=1)
    before.save_checkpoint()
    assert before.policy().shape.observation == env.get_observations()["student"].shape[1]
    assert not torch.equal(start.actor.state_dict()["mlp.0.weight"], before.actor.state_dict()["mlp.0.weight"])
    after = Distiller(made(own), trainer.policy(), own.student, tmp_path)
    assert after.iteration == 3
    assert torch.equal(after.actor.state_dict()["mlp.0.weight"], before.actor.state_dict()["mlp.0.weight"])
    table = follow(after.policy(), Manner(own.tried or own.env.student, own.scale), CLIPS, load_model(physics_hz=200.0))
    assert table["name"].tolist() == [clip.name for clip in CLIPS] and table["mpjpe_rad"].gt(0).all()


def test_distillation_brings_the_student_to_the_teacher(tmp_path: Path):
    own = small("omnih2o")
    env = made(replace(own, env=replace(own.env, start_share=1.0)))
    teacher = new_actor(shape_of(env, (8,)))
    with torch.no_grad():  # a teacher that always says the same
        teacher.mlp[-1].weight.zero_()
        teacher.mlp[-1].bias.copy_(torch.linspace(-0.2, 0.2, 23))
    config = replace(own.student, learning_rate=3e-3)
    distiller = Distiller(env, Policy(teacher, {}, shape_of(env, (8,))), config, tmp_path)
    seen, wanted = distiller._collect()
    assert torch.allclose(wanted, torch.linspace(-0.2, 0.2, 23))
    losses = [distiller._learn(seen, wanted).item() for _ in range(200)]
    assert losses[-1] < 0.3 * losses[0]


def test_losses():
    student, teacher = torch.tensor([[3.0, 4.0], [0.0, 0.0]]), torch.zeros(2, 2)
    assert action_loss("norm", student, teacher).item() == 2.5
    assert action_loss("mse", student, teacher).item() == 25 / 4


def test_the_reward_of_the_environment_is_the_baselines():
    own = small("exbody2")
    env = made(own)
    _, rewards, _, _ = env.step(torch.zeros(WORLDS, 23))
    # at the reference and at rest: alive, and the kernels near their best, a fiftieth of a second of it
    assert rewards.shape == (WORLDS,) and (rewards >= -0.5).all() and (rewards <= 13 * env.dt).all()
    assert env.scale.eq(0.25).all()


def test_leaning_beyond_44_degrees_loses():
    for angle, wanted in ((0.77, False), (0.78, True)):
        quat = from_rotation_vector(torch.tensor([[angle, 0.0, 0.0]]))
        assert tilted(state(root_quat_w=quat), reference()).item() is wanted


def test_the_librarys_speeds_are_central_differences_and_nought_after_the_end():
    library = MovingLibrary(CLIPS[:1])
    wanted = torch.as_tensor(differences(CLIPS[0].key_pos, 50.0))[20]
    assert torch.allclose(library.frames(torch.tensor([0]), torch.tensor([0.4])).key_vel_w[0], wanted)
    assert library.frames(torch.tensor([0]), torch.tensor([1e3])).key_vel_w.eq(0).all()


def test_local_errors_forgive_drift():
    drift = torch.tensor([3.0, 4.0, 0.0])
    moved = state(root_pos_w=state().root_pos_w + drift, key_pos_w=state().key_pos_w + drift)
    world, local = key_errors(moved, reference())
    assert torch.allclose(world, torch.tensor(5.0)) and torch.allclose(local, torch.tensor(0.0), atol=1e-6)


def test_a_policy_that_holds_the_reference_stands(tmp_path: Path):
    own = small("omnih2o")
    env = made(own)
    still = new_actor(shape_of(env, (8,)))
    with torch.no_grad():
        still.mlp[-1].weight.zero_()
        still.mlp[-1].bias.zero_()
    shape = replace(shape_of(env, (8,)), action="reference")
    table = follow(Policy(still, {}, shape), Manner(own.env.observation), CLIPS[:1], load_model(physics_hz=200.0))
    row = table.iloc[0]
    assert row["mpkpe_local_mm"] <= row["mpkpe_mm"] + 1e-3
    assert bool(row["success"]) == bool(row["lost_at"] != row["lost_at"])  # NaN where nothing was lost
