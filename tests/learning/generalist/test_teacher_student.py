"""The paper's teacher and student on tiny budgets: resuming, distillation, and onto the robot with a history."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import torch

from bumblebee.errors import BadInput
from bumblebee.learning.config import PAPER
from bumblebee.learning.export import export_policy
from bumblebee.learning.generalist.distill import PAPER_DAGGER, distill
from bumblebee.learning.generalist.teacher_student import make_env, train_student, train_teacher
from bumblebee.learning.learner import CURVE
from bumblebee.learning.policy import Policy, load_policy, new_actor, shape_of
from bumblebee.learning.ppo.learner import Trainer
from bumblebee.learning.trial import World, try_policy
from bumblebee.policy.exported import ExportedPolicy
from bumblebee.policy.robots import NominalRobots
from bumblebee.policy.runner import PolicyRunner, reference_library
from bumblebee.sim.sensors import load_model
from bumblebee.tracking.config import EnvConfig, Randomisation, Terrain
from bumblebee.tracking.env import TrackingEnv
from bumblebee.tracking.presets import PAPER_TASK, STUDENT, distillation_task
from tests.tracking.clips import waving

CLIPS = [waving("a", 50), waving("b", 70, speed=0.3)]
TASK = replace(PAPER_TASK, engine="mujoco", num_worlds=6, threads=1, episode_seconds=0.2)
PPO = replace(PAPER, iterations=4, steps=4, epochs=2, mini_batches=2, hidden=(16, 16), checkpoint_every=2)
DAGGER = replace(PAPER_DAGGER, iterations=30, steps=4, hidden=(32,), capacity=2000, learning_rate=3e-3)
QUIET = Randomisation(friction=(1.0, 1.0), gains=0.0, mass=0.0, push=0.0)


def weights(policy: Policy) -> torch.Tensor:
    return torch.cat([value.flatten().float() for value in policy.actor.state_dict().values()])


def everything(env: TrackingEnv) -> list[torch.Tensor]:
    """All tensors that an environment keeps, engine and generator included."""
    saved = env.state_dict()
    flat = [torch.as_tensor(value) for value in saved["engine"].values()]
    return flat + [value for value in saved.values() if isinstance(value, torch.Tensor)]


def test_killed_in_the_papers_task_it_goes_on_as_if_it_had_not_been(tmp_path: Path) -> None:
    """Histories, delays, ground, pushes, curriculum, sampler, optimiser, draws: the same weights, curve and worlds."""
    pushed = replace(TASK, randomisation=replace(TASK.randomisation, push_interval=0.1))
    whole = Trainer(make_env(CLIPS, pushed, 3), PPO, tmp_path / "whole", 3)
    whole.train()
    cut = Trainer(make_env(CLIPS, pushed, 3), PPO, tmp_path / "cut", 3)
    cut.train(enough=lambda: cut.iteration == 3)  # the third iteration is lost
    torch.manual_seed(99)  # another process has other draws
    again = Trainer(make_env(CLIPS, pushed, 4), PPO, tmp_path / "cut", 5)
    assert again.iteration == 2
    # What worlds were drawn belongs to the seed, which a resumed training has again.
    again = Trainer(make_env(CLIPS, pushed, 3), PPO, tmp_path / "cut", 3)
    again.train()
    assert torch.equal(weights(whole.policy()), weights(again.policy()))
    for one, other in zip(everything(whole.env), everything(again.env), strict=True):
        assert torch.equal(one, other)
    curves = [pd.read_csv(tmp_path / name / CURVE).drop(columns="seconds") for name in ("whole", "cut")]
    pd.testing.assert_frame_equal(*curves)


def test_teacher_and_student_train_from_one_call_each(tmp_path: Path) -> None:
    """The policies know what they see; both can be tried; what is saved is what was trained."""
    teacher = train_teacher(CLIPS, tmp_path, TASK, replace(PPO, iterations=2), seed=1)
    assert (teacher.shape.terms, teacher.shape.history, teacher.shape.action) == (("teacher",), 5, "default")
    student, curve = train_student(CLIPS, teacher, TASK, replace(DAGGER, iterations=3))
    assert (student.shape.terms, student.shape.history) == (STUDENT.terms, 10)
    assert student.shape.observation == 10 * 107
    assert list(curve["iteration"]) == [1, 2, 3] and np.isfinite(curve["kl"]).all()
    student.save(tmp_path)
    again = load_policy(tmp_path)
    assert again.shape == student.shape
    world = World(load_model(physics_hz=100), threads=1)
    tried = [try_policy(policy, CLIPS[:1], world, ()) for policy in (teacher, student, again)]
    assert tried[1].equals(tried[2]) and not tried[0].equals(tried[1])


def test_a_student_comes_to_do_what_its_teacher_does() -> None:
    """The KL to a teacher of random weights falls to a fifth in 30 rounds, though the student sees something else."""
    torch.manual_seed(0)
    env = make_env(CLIPS, distillation_task(TASK), seed=0)
    shape = shape_of(env, (16,))
    teacher = Policy(new_actor(shape, initial_std=0.5), {}, shape)
    torch.nn.init.normal_(teacher.actor.mlp[-1].bias, std=0.5)
    _, curve = distill(env, {0: teacher}, [0, 0], DAGGER)
    assert curve["kl"].iloc[-3:].mean() < 0.2 * curve["kl"].iloc[0]


def test_a_student_that_is_enough_stops(tmp_path: Path) -> None:
    """After the round that was enough."""
    env = make_env(CLIPS, distillation_task(TASK), seed=0)
    shape = shape_of(env, (16,))
    rounds: list[int] = []
    teacher = Policy(new_actor(shape), {}, shape)
    _, curve = distill(env, {0: teacher}, [0, 0], DAGGER, report=lambda n, _: rounds.append(n), enough=lambda: True)
    assert len(curve) == len(rounds) == 1


def test_the_robots_runner_sees_what_the_student_saw(tmp_path: Path) -> None:
    """Two robots, closed loop through ONNX and contract beside the environment: equal observations for 14 ticks."""
    config = distillation_task(
        TASK,
        num_worlds=2,
        randomisation=QUIET,
        terrain=Terrain(),
        reset_noise=0.0,
        start_share=1.0,
        episode_seconds=9.0,
    )
    env = make_env(CLIPS, config, seed=0)
    shape = shape_of(env, (32,), "student")
    student = Policy(new_actor(shape), {}, shape)
    torch.nn.init.normal_(student.actor.mlp[-1].weight, std=0.05)
    export_policy(tmp_path, student)
    policy = ExportedPolicy.load(tmp_path)
    assert policy.seen.history == 10 and policy.contract["action"]["base"] == "default"
    names = [env.library.names[int(i)] for i in env.clip]
    runner, robots = PolicyRunner(policy, reference_library(policy, CLIPS), names), NominalRobots(2, threads=1)
    both = np.arange(2)
    robots.reset(env.engine.batch.qpos.copy(), env.engine.batch.qvel.copy(), runner.hold())
    for tick in range(14):
        sensors = robots.read()
        seen = runner.observe(both, tick, sensors)
        torch.testing.assert_close(seen, env.groups["student"].exact, atol=2e-3, rtol=0)
        action, target = runner.step(both, tick, sensors)
        robots.step(both, target)
        env.step(student(env.groups["student"].exact))
        torch.testing.assert_close(torch.as_tensor(action, dtype=torch.float32), env._action, atol=2e-3, rtol=0)
    one = robots.read()[np.array([1])]
    torch.testing.assert_close(
        runner.observe(np.array([1]), 14, one), env.groups["student"].exact[1:], atol=2e-3, rtol=0
    )


def test_a_parent_that_saw_something_else_is_refused(tmp_path: Path) -> None:
    """A line that names the field: a policy of the demo's observation is no teacher."""
    demo = make_env(CLIPS, EnvConfig(num_worlds=2, threads=1, ahead=()), 0)
    shape = shape_of(demo, (16, 16))
    critic = Trainer(demo, PPO, tmp_path / "demo").algorithm.critic.state_dict()
    Policy(new_actor(shape), critic, shape).save(tmp_path)
    with pytest.raises(BadInput, match="terms: expected"):
        Trainer(make_env(CLIPS, TASK, 0), PPO, tmp_path / "t", parent=tmp_path)
