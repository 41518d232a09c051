"""The environment: shapes, reproducibility, ends of episodes, broken worlds, adapters, saving."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest
import torch

from bumblebee.sim.mujoco_cpu import MujocoCpu
from bumblebee.sim.sensors import load_model
from bumblebee.tracking.config import EnvConfig, ObservationConfig, Randomisation
from bumblebee.tracking.env import TrackingEnv
from bumblebee.tracking.observing.observations import action_scale, layout
from bumblebee.tracking.sampling.library import MotionLibrary
from bumblebee.tracking.worlds.randomisation import randomise_worlds
from tests.tracking.clips import waving

CONFIG = EnvConfig(num_worlds=6, threads=1)
QUIET = Randomisation(friction=(1.0, 1.0), gains=0.0, mass=0.0, push=0.0)


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    return load_model(physics_hz=100)


def make(model: mujoco.MjModel, config: EnvConfig = CONFIG, seed: int = 0, **more: object) -> TrackingEnv:
    library = MotionLibrary([waving("a", 60), waving("b", 90)], config.ahead)
    return TrackingEnv(library, MujocoCpu(model, config.num_worlds, threads=1), config, seed, **more)


def rollout(env: TrackingEnv, steps: int = 12) -> torch.Tensor:
    generator = torch.Generator().manual_seed(5)
    rows = []
    for _ in range(steps):
        seen, reward, done, _ = env.step(0.5 * torch.randn(env.num_envs, 23, generator=generator))
        rows.append(torch.cat([seen["policy"], seen["critic"], reward[:, None], done[:, None].float()], dim=1))
    return torch.stack(rows)


def test_shapes_are_those_that_rsl_rl_expects(model: mujoco.MjModel) -> None:
    """Groups, rewards, dones, time-outs; the critic sees the policy's observation and more."""
    env = make(model)
    seen, reward, done, extras = env.step(torch.zeros(6, 23))
    size = sum(n for _, n in layout(23, len(CONFIG.ahead)))
    assert seen["policy"].shape == (6, size)
    assert seen["critic"].shape[1] > size
    assert reward.shape == done.shape == extras["time_outs"].shape == (6,)
    assert done.dtype == torch.bool


def test_same_seed_same_rollout_other_seed_another(model: mujoco.MjModel) -> None:
    """Everything random hangs on the seed."""
    first, again, other = (rollout(make(model, seed=s)) for s in (1, 1, 2))
    assert torch.equal(first, again)
    assert not torch.equal(first, other)


def test_observations_given_away_are_not_changed_later(model: mujoco.MjModel) -> None:
    """rsl_rl keeps the tensors of earlier steps."""
    env = make(model)
    seen = env.get_observations()["policy"]
    copy = seen.clone()
    env.step(torch.ones(6, 23))
    assert torch.equal(seen, copy)


def test_a_clips_end_is_a_time_out_and_a_far_key_body_a_failure(model: mujoco.MjModel) -> None:
    """Zero noise, zero action: a still clip ends by time-out; with a threshold of 1 mm every episode fails."""
    calm = replace(CONFIG, reset_noise=0.0, start_share=1.0, randomisation=QUIET)
    env = make(model, calm)
    done = torch.zeros(6, dtype=torch.bool)
    steps = 0
    while not done.any():
        clips, steps = env.clip.clone(), steps + 1
        _, _, done, extras = env.step(torch.zeros(6, 23))
    assert steps == int(env.library.length[clips].min()) - 1
    assert torch.equal(extras["time_outs"].bool(), done)
    strict = make(model, replace(calm, threshold_start=0.001, threshold_end=0.001))
    for _ in range(5):
        _, _, done, extras = strict.step(torch.ones(6, 23))
    assert done.all() and not extras["time_outs"].any()


def test_episodes_are_cut_at_their_longest(model: mujoco.MjModel) -> None:
    """A cut episode is a time-out too."""
    env = make(model, replace(CONFIG, episode_seconds=0.1, reset_noise=0.0, randomisation=QUIET))
    for _ in range(5):
        _, _, done, extras = env.step(torch.zeros(6, 23))
    assert done.all() and extras["time_outs"].all()
    assert (env.episode_length_buf == 0).all()


def test_a_world_that_blows_up_fails_alone_and_is_restarted(model: mujoco.MjModel, tmp_path, monkeypatch) -> None:
    """It earns nothing, ends, is counted, and its next observation is a number."""
    monkeypatch.chdir(tmp_path)  # MuJoCo logs the warning into the working directory
    env = make(model)
    env.statistics.take()
    env.engine.batch.qvel[2, 0] = np.nan
    seen, reward, done, _ = env.step(torch.zeros(6, 23))
    assert done[2] and reward[2] == 0
    assert torch.isfinite(reward).all() and torch.isfinite(seen["critic"]).all()
    taken = env.statistics.take()
    assert taken["unstable"] == 1
    assert all(np.isfinite(value) for name, value in taken.items())


def test_the_adapter_changes_what_the_motors_do_and_nothing_else(model: mujoco.MjModel) -> None:
    """With an adapter that removes the action, any action moves the robot like none; the policy still sees its own."""
    config = replace(CONFIG, observation_noise=0.0)
    plain = make(model, config)
    adapted = make(model, config, action_adapter=lambda state, seen, action: torch.zeros_like(action))
    a = plain.step(torch.zeros(6, 23))[0]["policy"]
    b = adapted.step(torch.ones(6, 23))[0]["policy"]
    first = {}
    start = 0
    for name, size in layout(23, len(config.ahead)):
        first[name] = slice(start, start + size)
        start += size
    assert torch.allclose(a[:, first["joint_pos"]], b[:, first["joint_pos"]])
    assert (b[:, first["last_action"]] == 1).all() and (a[:, first["last_action"]] == 0).all()


def test_saved_and_loaded_it_goes_on_alike(model: mujoco.MjModel) -> None:
    """State, draws, sampler and noise continue bit for bit."""
    env = make(model)
    rollout(env, 7)
    saved = env.state_dict()
    other = make(model)
    other.load_state_dict(saved)
    assert torch.equal(other.get_observations()["policy"], env.get_observations()["policy"])
    assert torch.equal(rollout(env, 10), rollout(other, 10))


def test_what_was_seen_in_training_can_be_put_back_outside_of_it(model: mujoco.MjModel) -> None:
    """Steps in torch's inference mode, as in training, make tensors that nobody may write later; loading does not."""
    env = make(model)
    with torch.inference_mode():
        saved, seen = env.state_dict(), env.get_observations()
        first = rollout(env, 5)
    kept = {name: seen[name].clone() for name in ("policy", "critic")}
    env.load_state_dict(saved)
    assert torch.equal(rollout(env, 5), first)
    assert all(torch.equal(seen[name], values) for name, values in kept.items())


def test_a_step_leaves_torchs_threads_as_they_were(model: mujoco.MjModel) -> None:
    """The step itself has one; whoever trains keeps theirs, also when the step fails."""
    before, seen = torch.get_num_threads(), []
    env = make(model, action_adapter=lambda state, middle, action: seen.append(torch.get_num_threads()) or action)
    try:
        torch.set_num_threads(2)
        env.step(torch.zeros(6, 23))
        with pytest.raises(RuntimeError):
            env.step(torch.zeros(6, 5))
        assert torch.get_num_threads() == 2 and seen == [1, 1]
    finally:
        torch.set_num_threads(before)


def test_worlds_differ_as_much_as_asked(model: mujoco.MjModel) -> None:
    """Gains, masses and friction lie within their ranges and are not all the same; quiet settings change nothing."""
    engine = MujocoCpu(model, 8, threads=1)
    randomise_worlds(engine, Randomisation(friction=(0.6, 1.2), gains=0.1, mass=0.05), seed=0)
    gain = engine.batch.expand("actuator_gainprm")[:, :, 0] / model.actuator_gainprm[:, 0]
    mass = engine.batch.expand("body_mass")[:, 1:] / model.body_mass[1:]
    friction = engine.batch.expand("geom_friction")[:, :, 0] / model.geom_friction[:, 0]
    for values, low, high in ((gain, 0.9, 1.1), (mass, 0.95, 1.05), (friction, 0.6, 1.2)):
        assert low <= values.min() < values.max() <= high
    bias = engine.batch.expand("actuator_biasprm")[:, :, 1]
    np.testing.assert_allclose(bias, -engine.batch.expand("actuator_gainprm")[:, :, 0])
    quiet = MujocoCpu(model, 2, threads=1)
    randomise_worlds(quiet, QUIET, seed=0)
    assert quiet.batch.expanded("body_mass") is None and quiet.batch.expanded("actuator_gainprm") is None


def test_the_scale_of_the_action_is_bounded() -> None:
    """With the declared gains every joint saturates only far away, so that all stand at the upper bound."""
    scale = action_scale()
    assert scale.shape == (23,)
    assert torch.allclose(scale, torch.tensor(0.35))


def test_noise_drawn_on_a_thread_of_its_own_is_the_same(model: mujoco.MjModel) -> None:
    """Two threads draw the numbers that one draws, in the same order, for a policy and for its student."""
    student = ObservationConfig(terms=("student",), history=2)
    config = replace(CONFIG, student=student, observation_noise=1.0, episode_seconds=0.1)
    one, two = (make(model, replace(config, threads=threads)) for threads in (1, 2))
    generator = torch.Generator().manual_seed(5)
    for _ in range(12):
        action = torch.randn(6, 23, generator=generator)
        alone, aside = one.step(action)[0], two.step(action)[0]
        for group in ("policy", "critic", "student"):
            assert torch.equal(alone[group], aside[group])
        assert not torch.equal(aside["policy"], aside["critic"][:, : aside["policy"].shape[1]])
