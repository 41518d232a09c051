"""PPO around the environment: learning, resuming, configuration, the curve."""

import inspect
import re
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pandas as pd
import pytest
import torch
from rsl_rl.algorithms import PPO
from rsl_rl.models import MLPModel

from bumblebee.errors import BadInput
from bumblebee.learning.config import PAPER, PpoConfig
from bumblebee.learning.curve import CurveWriter
from bumblebee.learning.learner import CHECKPOINT, CURVE
from bumblebee.learning.ppo.learner import BoundedPpo, Trainer, runner_config
from bumblebee.sim.mujoco_cpu import MujocoCpu
from bumblebee.sim.sensors import load_model
from bumblebee.tracking.config import EnvConfig
from bumblebee.tracking.env import TrackingEnv
from bumblebee.tracking.rewards import ERRORS, PENALTIES, RewardConfig
from bumblebee.tracking.sampling.library import MotionLibrary
from tests.tracking.clips import waving

ENV = EnvConfig(num_worlds=8, threads=1, physics_hz=100)
PPO_CONFIG = PpoConfig(iterations=4, steps=4, epochs=2, mini_batches=2, hidden=(16, 16), checkpoint_every=2)


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    return load_model(physics_hz=100)


def trainer(model: mujoco.MjModel, folder: Path, config: PpoConfig = PPO_CONFIG, **more: object) -> Trainer:
    library = MotionLibrary([waving("a", 50), waving("b", 70)], ENV.ahead)
    env = TrackingEnv(library, MujocoCpu(model, ENV.num_worlds, threads=1), ENV, seed=3)
    return Trainer(env, config, folder, seed=3, **more)


def weights(trained: Trainer) -> torch.Tensor:
    return torch.cat([value.flatten().float() for value in trained.policy().actor.state_dict().values()])


def test_a_killed_training_goes_on_as_if_it_had_not_been_killed(model: mujoco.MjModel, tmp_path: Path) -> None:
    """Stopped after the checkpoint of iteration 2 and begun again, it ends with the same weights and curve."""
    whole = trainer(model, tmp_path / "whole")
    whole.train()
    first = trainer(model, tmp_path / "cut")
    original = first._iterate

    def killed() -> dict[str, float]:
        if first.iteration == 3:
            raise KeyboardInterrupt
        return original()

    first._iterate = killed  # type: ignore[method-assign]
    with pytest.raises(KeyboardInterrupt):
        first.train()
    again = trainer(model, tmp_path / "cut")
    assert again.iteration == 2
    again.train()
    assert torch.equal(weights(whole), weights(again))
    curves = [pd.read_csv(tmp_path / name / CURVE).drop(columns="seconds") for name in ("whole", "cut")]
    pd.testing.assert_frame_equal(*curves)
    assert list(curves[0]["iteration"]) == [1, 2, 3, 4]


def test_a_checkpoint_appears_whole_or_not_at_all(model: mujoco.MjModel, tmp_path: Path, monkeypatch) -> None:
    """If writing fails half way, the checkpoint before it still stands."""
    trained = trainer(model, tmp_path)
    trained.train()
    before = (tmp_path / CHECKPOINT).read_bytes()

    def broken(path: Path, content: object) -> None:
        raise OSError("no space left")

    monkeypatch.setattr(Path, "write_bytes", broken)
    with pytest.raises(OSError, match="no space"):
        trained.save_checkpoint()
    assert (tmp_path / CHECKPOINT).read_bytes() == before


def test_a_child_starts_as_its_parent(model: mujoco.MjModel, tmp_path: Path) -> None:
    """Before its first update it acts exactly like the policy that it was given, normalisation included."""
    parent = trainer(model, tmp_path / "p")
    parent.train()
    parent.policy().save(tmp_path)
    child = trainer(model, tmp_path / "c", parent=tmp_path)
    seen = torch.randn(5, parent.policy().shape.observation)
    assert torch.equal(child.policy()(seen), parent.policy()(seen))
    assert child.iteration == 0


def test_at_first_the_value_may_learn_alone(model: mujoco.MjModel, tmp_path: Path) -> None:
    """For a parent without a critic, as the line says that refuses it; then the policy learns, too."""
    parent = trainer(model, tmp_path / "parent").policy()
    parent.critic_state = {}
    parent.save(tmp_path)
    with pytest.raises(BadInput, match="critic") as refused:
        trainer(model, tmp_path / "child", parent=tmp_path)
    (first,) = re.findall(r"`ppo.value_first: (\d+)`", refused.value.do)
    assert int(first) >= 1
    child = trainer(model, tmp_path / "child", replace(PPO_CONFIG, iterations=3, value_first=2), parent=tmp_path)
    begun, critic = weights(child), child.policy().critic_state
    child.train(enough=lambda: child.iteration == 2)
    assert torch.equal(weights(child), begun)
    assert not torch.equal(child.policy().critic_state["mlp.0.weight"], critic["mlp.0.weight"])
    child.train()
    assert not torch.equal(weights(child), begun)
    losses = pd.read_csv(tmp_path / "child" / CURVE)
    assert (losses["loss_value"] > 0).all() and (losses["loss_surrogate"] != 0).tolist() == [False, False, True]


def test_it_learns_what_is_rewarded(model: mujoco.MjModel, tmp_path: Path) -> None:
    """If only calm actions are rewarded, they become calm: the penalty shrinks by a quarter within 16 updates."""
    only = dict.fromkeys([*PENALTIES, *ERRORS], 0.0) | {"action_rate": -1.0}
    task = replace(ENV, num_worlds=64, reward=RewardConfig(weights=only))
    learner = dict(iterations=16, steps=8, epochs=5, mini_batches=4, gamma=0.5, learning_rate_range=(4e-3, 4e-3))
    config = replace(PPO_CONFIG, **learner)
    env = TrackingEnv(MotionLibrary([waving("a", 100)], ENV.ahead), MujocoCpu(model, 64, threads=1), task, 0)
    Trainer(env, config, tmp_path, seed=0).train()
    curve = pd.read_csv(tmp_path / CURVE)
    assert curve["reward"].iloc[-1] > 0.75 * curve["reward"].iloc[0]
    assert np.isfinite(curve.drop(columns=["episode_length", "success"])).all().all()
    assert (curve["threshold"].diff().dropna() <= 0).all()


def test_every_key_of_the_configuration_is_one_that_rsl_rl_reads() -> None:
    """Its top level ignores unknown keys in silence, so the names are compared with its signatures."""
    config = runner_config(PpoConfig())
    known = set(inspect.signature(PPO.__init__).parameters) | {"class_name", "learning_rate_range", "captured"}
    assert set(config["algorithm"]) <= known
    network = set(inspect.signature(MLPModel.__init__).parameters) | {"class_name"}
    assert set(config["actor"]) <= network and set(config["critic"]) <= network
    assert set(config) == {"num_steps_per_env", "obs_groups", "algorithm", "actor", "critic"}


def test_the_learning_rate_keeps_its_bounds(model: mujoco.MjModel, tmp_path: Path) -> None:
    """However far the KL divergence is off its target; the paper's fixed rate never moves."""
    bounded = trainer(model, tmp_path / "a", replace(PPO_CONFIG, desired_kl=1e3, desired_kl_end=1e3))
    bounded.train()
    assert bounded.algorithm.learning_rate == PPO_CONFIG.learning_rate_range[1]
    assert isinstance(bounded.algorithm, BoundedPpo)
    fixed = replace(PAPER, iterations=2, steps=4, hidden=(16, 16))
    assert trained_rate(trainer(model, tmp_path / "b", fixed)) == 1e-4


def trained_rate(trained: Trainer) -> float:
    trained.train()
    return trained.algorithm.learning_rate


def test_the_curve_grows_row_by_row_and_drops_what_is_trained_again(tmp_path: Path) -> None:
    """A row is on disk as soon as it is flushed; rows beyond the checkpoint go when training resumes."""
    path = tmp_path / CURVE
    writer = CurveWriter(path)
    for step in (1, 2, 3):
        writer.add_scalar("reward", step / 10, step)
        writer.flush()
        assert len(pd.read_csv(path)) == step
    again = CurveWriter(path, done=2)
    again.add_scalar("reward", 9.0, 3)
    again.stop()
    assert pd.read_csv(path)["reward"].tolist() == [0.1, 0.2, 9.0]
