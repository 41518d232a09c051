"""Histories: order, resets, and as part of the environment's observations."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest
import torch

from bumblebee.errors import BadInput
from bumblebee.sim.mujoco_cpu import MujocoCpu
from bumblebee.sim.sensors import load_model
from bumblebee.tracking.config import EnvConfig, ObservationConfig
from bumblebee.tracking.env import TrackingEnv
from bumblebee.tracking.observing.history import History
from bumblebee.tracking.rows import Rows
from bumblebee.tracking.sampling.library import MotionLibrary
from tests.tracking.clips import waving

SEEN = ObservationConfig(terms=("joint_pos", "last_action"), history=3)
CONFIG = EnvConfig(num_worlds=5, threads=1, observation=SEEN, student=replace(SEEN, history=4, now=("root_height",)))


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    return load_model(physics_hz=100)


def make(model: mujoco.MjModel, config: EnvConfig = CONFIG) -> TrackingEnv:
    library = MotionLibrary([waving("a", 60), waving("b", 90)], config.ahead)
    return TrackingEnv(library, MujocoCpu(model, config.num_worlds, threads=1), config, 1)


def steps(env: TrackingEnv, group: str, history: int) -> torch.Tensor:
    """A group's exact observation as (B, H, D)."""
    own = env.groups[group]
    size = sum(n for _, n in own.parts)
    return own.exact[:, : history * size].unflatten(1, (history, size))


@pytest.mark.parametrize("by_mask", [False, True])
def test_the_newest_rows_stand_last_and_a_fresh_world_has_no_other_past(by_mask: bool) -> None:
    """Rows 1 to 5 in a ring of three; world 1 begins anew with row 4."""
    ring = History(2, 1, 3)
    for value in range(1, 6):
        fresh = torch.tensor([value == 1, value in (1, 4)])
        ring.add(torch.full((2, 1), float(value)), Rows(fresh, by_mask))
    assert ring.stacked().tolist() == [[3.0, 4.0, 5.0], [4.0, 4.0, 5.0]]


def test_an_environments_history_is_what_was_seen_before(model: mujoco.MjModel) -> None:
    """Teacher and student alike; the newest step's own terms come last."""
    env = make(model)
    past = [steps(env, "policy", 3)[:, -1].clone()]
    first = steps(env, "policy", 3)
    assert torch.equal(first[:, 0], first[:, 2])
    for _ in range(3):
        env.step(torch.randn(5, 23))
        past.append(steps(env, "policy", 3)[:, -1].clone())
    assert torch.equal(steps(env, "policy", 3), torch.stack(past[-3:], dim=1))
    assert torch.equal(steps(env, "student", 4), torch.stack(past[-4:], dim=1))
    assert torch.equal(env.groups["student"].exact[:, -1], env._state.root_pos_w[:, 2])
    noisy = env.get_observations()["policy"]
    assert noisy.shape == first.flatten(1).shape and not torch.equal(noisy, env.groups["policy"].exact)


def test_noise_stays_in_the_history_as_it_was_seen(model: mujoco.MjModel) -> None:
    """A reading is noisy once, not anew each time that it is looked back at."""
    env = make(model)
    before = env.get_observations()["policy"].unflatten(1, (3, 46))[:, -1]
    env.step(torch.zeros(5, 23))
    after = env.get_observations()["policy"].unflatten(1, (3, 46))
    assert torch.equal(after[:, 1], before)


def test_a_restarted_world_sees_nothing_of_its_past(model: mujoco.MjModel) -> None:
    """Episodes of 3 steps: after the cut all steps of the history are the new start."""
    env = make(model, replace(CONFIG, episode_seconds=0.06))
    for _ in range(2):
        env.step(torch.ones(5, 23))
    _, _, done, _ = env.step(torch.ones(5, 23))
    assert done.all()
    seen = steps(env, "policy", 3)
    assert torch.equal(seen, seen[:, :1].expand_as(seen))
    assert (seen[..., 23:] == 0).all()  # the last action of nobody


def test_a_world_that_blows_up_leaves_no_trace_in_its_history(model: mujoco.MjModel, tmp_path, monkeypatch) -> None:
    """Reset, counted, and every step that it sees afterwards is a number."""
    monkeypatch.chdir(tmp_path)  # MuJoCo logs the warning into the working directory
    env = make(model)
    env.step(torch.zeros(5, 23))
    env.statistics.take()
    env.engine.batch.qpos[2, 9] = np.nan
    seen, reward, done, _ = env.step(torch.zeros(5, 23))
    assert done[2] and reward[2] == 0 and env.statistics.take()["unstable"] == 1
    for group in ("policy", "student", "critic"):
        assert torch.isfinite(seen[group]).all()
    own = steps(env, "policy", 3)[2]
    assert torch.equal(own, own[:1].expand_as(own))


def test_a_history_of_no_step_is_refused(model: mujoco.MjModel) -> None:
    """It names the field."""
    with pytest.raises(BadInput, match=r"ObservationConfig\.history"):
        make(model, replace(CONFIG, observation=replace(SEEN, history=0)))
