"""Two tiny experts become one generalist with a memory: it agrees better, survives a kill, and runs on the robot."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from bumblebee.errors import BadInput
from bumblebee.learning.export import export_policy
from bumblebee.learning.gaussian import gaussian, gaussian_kl
from bumblebee.learning.generalist.distill import DistillConfig, Distiller
from bumblebee.learning.generalist.transformer import TransformerConfig
from bumblebee.learning.policy import Policy, Shape, new_actor, shape_of
from bumblebee.learning.trial import World, try_policy
from bumblebee.policy.exported import ExportedPolicy
from bumblebee.policy.robots import NominalRobots
from bumblebee.policy.runner import PolicyRunner, reference_library
from bumblebee.sim.sensors import load_model
from bumblebee.tracking.config import EnvConfig
from bumblebee.tracking.env import TrackingEnv
from bumblebee.tracking.presets import STUDENT
from bumblebee.tracking.sampling.starts import start_state
from tests.learning.tiny import CLIPS, env_of

OWN = TransformerConfig(embedding=24, heads=3, memory=5, feed_forward=16, head=(24,))
TASK = EnvConfig(num_worlds=8, threads=1, ahead=(), student=STUDENT, episode_seconds=0.3)
CONFIG = DistillConfig(
    iterations=40,
    steps=4,
    learning_rate=2e-3,
    capacity=2000,
    init="scratch",
    model="transformer",
    transformer=OWN,
    checkpoint_every=4,
    env=TASK,
)
CLUSTER = [0, 1]


def expert(shape: Shape, seed: int) -> Policy:
    """Whatever it sees, it holds a pose of its own and moves a little."""
    torch.manual_seed(seed)
    actor = new_actor(shape, initial_std=0.4)
    torch.nn.init.normal_(actor.mlp[-1].bias, std=0.5)
    return Policy(actor, {}, shape)


def task() -> tuple[TrackingEnv, dict[int, Policy]]:
    env = env_of(TASK, seed=3)
    shape = shape_of(env, (16,))
    return env, {0: expert(shape, 1), 1: expert(shape, 2)}


@torch.inference_mode()
def apart(student: Policy, seed: int = 9) -> float:
    """Mean KL(student || expert of the clip) along the student's own episodes."""
    env, experts = env_of(TASK, seed=seed), task()[1]
    actor, sums = student.actor, []
    actor.reset()
    for _ in range(40):
        groups = env.get_observations()
        mean, std = gaussian(actor, groups["student"])
        wanted = [gaussian(experts[index].actor, groups["policy"]) for index in (0, 1)]
        own = env.clip[:, None] == 0
        other = [torch.where(own, *pair) for pair in zip(*wanted, strict=True)]
        sums.append(gaussian_kl(mean, std, *other).mean())
        actor.reset(env.step(mean)[2])
    return float(torch.stack(sums).mean())


def test_two_experts_become_one_policy_with_a_memory() -> None:
    """The KL falls to a fifth while it learns, and along its own episodes it beats the untrained one."""
    distiller = Distiller(*task(), CLUSTER, CONFIG)
    before = apart(distiller.policy())
    distiller.train()
    curve, after = distiller.curve(), apart(distiller.policy())
    assert curve["kl"].iloc[-3:].mean() < 0.2 * curve["kl"].iloc[0]
    assert after < 0.7 * before


def test_killed_it_goes_on_from_its_last_checkpoint(tmp_path: Path) -> None:
    """Network, optimiser and curve are those of iteration 8; it ends with one row an iteration, and no worse."""
    cut = Distiller(*task(), CLUSTER, CONFIG, folder=tmp_path)
    passed: dict[int, Policy] = {}

    def killed() -> bool:
        passed[cut.iteration] = cut.policy()
        if cut.iteration == 10:
            raise KeyboardInterrupt
        return False

    with pytest.raises(KeyboardInterrupt):
        cut.train(enough=killed)
    again = Distiller(*task(), CLUSTER, CONFIG, folder=tmp_path)
    assert again.iteration == 8
    for one, other in zip(again.policy().actor.parameters(), passed[8].actor.parameters(), strict=True):
        assert torch.equal(one, other)
    assert again._optimiser.state_dict()["state"][0]["step"] == 8 * CONFIG.epochs * CONFIG.mini_batches
    again.train()
    assert list(again.curve()["iteration"]) == list(range(1, 41))
    assert again.curve()["kl"].iloc[-3:].mean() < 0.2 * again.curve()["kl"].iloc[0]


def test_a_checkpoint_of_other_settings_is_refused(tmp_path: Path) -> None:
    Distiller(*task(), CLUSTER, CONFIG).save_checkpoint(tmp_path)
    for other, word in (
        (replace(CONFIG, learning_rate=1e-3), "learning_rate"),
        (replace(CONFIG, transformer=replace(OWN, memory=4)), "student's transformer"),
    ):
        with pytest.raises(BadInput, match=word) as refused:
            Distiller(*task(), CLUSTER, other, folder=tmp_path)
        assert "\n" not in str(refused.value)


def test_a_missing_expert_is_refused_before_training() -> None:
    env, experts = task()
    with pytest.raises(
        BadInput, match="experts: expected one for each of 2 clusters of motions, came none for cluster 1"
    ):
        Distiller(env, {0: experts[0]}, CLUSTER, CONFIG)


def test_an_expert_with_a_memory_is_refused() -> None:
    env, experts = task()
    student = Distiller(env, experts, CLUSTER, CONFIG).policy()
    with pytest.raises(BadInput, match="expert 1: expected a policy without a memory"):
        Distiller(env, {0: experts[0], 1: student}, CLUSTER, CONFIG)


def test_a_transformer_cannot_start_from_an_mlp() -> None:
    with pytest.raises(BadInput, match=r"init: expected scratch"):
        replace(CONFIG, init="base")


def test_base_gives_a_transformer_of_its_own_observation_the_normalisation() -> None:
    """Without observations of its own the student sees what base sees, and keeps base's statistics."""
    env = env_of(replace(TASK, student=EnvConfig().student))
    shape = shape_of(env, (16,))
    base = expert(shape, 1)
    base.actor.train().update_normalization({"policy": torch.randn(50, shape.observation)})
    distiller = Distiller(env, {0: base}, [0, 0], replace(CONFIG, iterations=2), base)
    distiller.train()
    normalizer = distiller.policy().actor.obs_normalizer
    assert distiller.shape == replace(shape, hidden=OWN.head, transformer=OWN)
    assert torch.equal(normalizer._mean, base.actor.obs_normalizer._mean)


def test_by_mask_the_experts_answer_as_by_index() -> None:
    """A GPU asks every expert about every world and takes the cluster's; a CPU asks each about its own."""
    env, experts = task()
    distiller = Distiller(env, experts, CLUSTER, CONFIG)
    known = env.get_observations()["policy"]
    now = distiller._of_clip[env.clip]
    by_index = distiller._answers(known, now)
    env.engine.by_mask = True
    for one, other in zip(by_index, distiller._answers(known, now), strict=True):
        torch.testing.assert_close(one, other)


class Watched(Policy):
    """Keeps the actions that it took."""

    def follower(self) -> Callable[[torch.Tensor], torch.Tensor]:
        self.taken: list[torch.Tensor] = []
        act = super().follower()

        def watched(observation: torch.Tensor) -> torch.Tensor:
            self.taken.append(act(observation))
            return self.taken[-1]

        return watched


@torch.inference_mode()
def test_the_robots_closed_loop_is_that_of_the_trial(tmp_path: Path) -> None:
    """Two clips through ONNX, contract and runner take the actions of the trial; at tick 0 all is forgotten."""
    env = env_of(TASK)
    shape = replace(shape_of(env, OWN.head, "student"), transformer=OWN)
    torch.manual_seed(0)
    student = Watched(new_actor(shape), {}, shape)
    torch.nn.init.normal_(student.actor.mlp[-1].weight, std=0.2)
    export_policy(tmp_path, student)
    try_policy(student, CLIPS, World(load_model(physics_hz=200), threads=1), ())
    policy, names, both = ExportedPolicy.load(tmp_path), [clip.name for clip in CLIPS], np.arange(2)
    assert policy.memory == (5, 25)
    library = reference_library(policy, CLIPS)
    runner, robots = PolicyRunner(policy, library, names), NominalRobots(2, threads=1)
    start = start_state(library.frames(torch.arange(2), torch.zeros(2)), 0.0, torch.Generator())
    robots.reset(*(tensor.numpy().astype(np.float64) for tensor in start), runner.hold())
    for tick in range(30):
        actions, command = runner.step(both, tick, robots.read())
        np.testing.assert_allclose(actions, student.taken[tick].numpy(), atol=5e-3)
        robots.step(both, command)
    assert torch.stack(student.taken[:30]).abs().max() > 0.1
    begun = [one.step(both, 0, robots.read())[0] for one in (runner, PolicyRunner(policy, library, names))]
    np.testing.assert_allclose(*begun, atol=1e-6)


@pytest.mark.gpu
@pytest.mark.skipif(not torch.cuda.is_available(), reason="no NVIDIA GPU")
def test_on_a_gpu_it_learns_and_goes_on(tmp_path: Path) -> None:
    """Worlds, samples and memories on the device; the checkpoint of one Distiller is gone on from by another."""
    pytest.importorskip("mujoco_warp", reason="the extra `gpu` is not installed")
    config = replace(CONFIG, env=replace(TASK, engine="mujoco_warp", num_worlds=256), capacity=50_000)
    experts = task()[1]
    one = Distiller(env_of(config.env), experts, CLUSTER, config, folder=tmp_path)
    one.train(enough=lambda: one.iteration == 20)
    assert one._data._row.is_cuda and one.student._memory.is_cuda
    other = Distiller(env_of(config.env), experts, CLUSTER, config, folder=tmp_path)
    assert other.iteration == 20
    other.train()
    assert other.curve()["kl"].iloc[-3:].mean() < 0.3 * other.curve()["kl"].iloc[0]
    assert next(other.policy().actor.parameters()).device.type == "cpu"
