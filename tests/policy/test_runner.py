"""The robot's 50 Hz step is the training environment's."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from bumblebee.errors import BadInput
from bumblebee.evaluation.contract import StartNoise
from bumblebee.learning.export import export_policy
from bumblebee.learning.policy import Policy, Shape, new_actor
from bumblebee.policy import episodes
from bumblebee.policy.episodes import Episode, run_episodes
from bumblebee.policy.exported import ExportedPolicy
from bumblebee.policy.robots import NominalRobots
from bumblebee.policy.runner import PolicyRunner, reference_library, robot_state
from bumblebee.robot.sensors import NO_NOISE, SensorNoise, Sensors, add_noise, draws
from bumblebee.sim.mujoco_cpu import MujocoCpu
from bumblebee.sim.rotations import from_rotation_vector, multiply
from bumblebee.sim.sensors import load_model
from bumblebee.tracking.observing.observations import joint_targets, observe
from bumblebee.tracking.observing.terms import parts
from bumblebee.tracking.sampling.library import AHEAD, MotionLibrary
from bumblebee.tracking.terminations import FALL, fallen
from tests.policy.conftest import nod


@pytest.mark.parametrize("ahead", [AHEAD, (0.1, 0.3, 0.6, 1.0), ()])
def test_observation_and_motion_equal_the_engines_step_by_step(
    policy_folder: Callable[..., Path], ahead: tuple[float, ...]
) -> None:
    """A policy closed-loop in the training engine and through the runner has equal observations for ten ticks."""
    clip, policy = nod(), ExportedPolicy.load(policy_folder(gain=0.02, ahead=ahead))
    assert policy.ahead == len(ahead)
    library, ids = reference_library(policy, [clip]), torch.zeros(1, dtype=torch.long)
    assert library.ahead == ahead
    engine = MujocoCpu(load_model(), 1, threads=1)
    robots, runner = NominalRobots(1, threads=1), PolicyRunner(policy, library, [clip.name])
    qpos = np.concatenate([clip.root_pos[:1], clip.root_quat[:1], clip.joint_pos[:1]], axis=1).astype(np.float64)
    qvel = np.random.default_rng(0).normal(0, 0.1, (1, 29))
    robots.reset(qpos, qvel, qpos[:, 7:])
    engine.reset(ids, *(torch.as_tensor(a) for a in (qpos, qvel, qpos[:, 7:])))
    last = torch.zeros(1, 23)
    for tick in range(10):
        sensors, reference = robots.read(), library.frames(ids, torch.full((1,), (tick + 1) * 0.02))
        expected = observe(engine.state(), reference, last)
        assert torch.allclose(runner.observe(np.array([0]), tick, sensors), expected, atol=2e-4), tick
        _, command = runner.step(np.array([0]), tick, sensors)
        last = torch.as_tensor(policy.act(expected.numpy()))
        wanted = joint_targets(reference, last, torch.as_tensor(policy.scale, dtype=torch.float32))
        assert np.allclose(command.target, wanted.numpy(), atol=1e-4)
        robots.step(np.array([0]), command)
        engine.step(wanted)


def test_with_encoders_that_are_off_the_engine_shows_what_the_robot_would_believe(
    policy_folder: Callable[..., Path],
) -> None:
    """Readings with an offset: the runner's observation is the engine's, which keeps the true bodies beside it."""
    clip, policy = nod(), ExportedPolicy.load(policy_folder())
    library, ids = reference_library(policy, [clip]), torch.zeros(1, dtype=torch.long)

    class Off:
        encoder_offset = np.where(np.arange(23) == 3, 0.06, 0.0)

    engine, robots = MujocoCpu(load_model(), 1, threads=1, hooks=Off()), NominalRobots(1, threads=1)
    qpos = np.concatenate([clip.root_pos[:1], clip.root_quat[:1], clip.joint_pos[:1]], axis=1).astype(np.float64)
    qvel = np.random.default_rng(0).normal(0, 0.1, (1, 29))
    robots.reset(qpos, qvel, qpos[:, 7:])
    engine.reset(ids, *(torch.as_tensor(a) for a in (qpos, qvel, qpos[:, 7:])))
    true = robots.read()
    off = Sensors(**{**vars(true), "joint_pos": true.joint_pos + Off.encoder_offset})
    runner, state = PolicyRunner(policy, library, [clip.name]), engine.state()
    expected = observe(state, library.frames(ids, torch.full((1,), 0.02)), torch.zeros(1, 23))
    assert torch.allclose(runner.observe(np.array([0]), 0, off), expected, atol=1e-5)
    assert torch.allclose(state.key_pos_w, robot_state(true).key_pos_w, atol=1e-5)
    assert state.read_key_pos_w is not None and (state.read_key_pos_w - state.key_pos_w).norm(dim=-1).max() > 0.01


def test_key_bodies_come_from_the_readings_alone() -> None:
    """An encoder that reads 0.1 rad more moves the foot where the policy believes it to be, and nothing else."""
    robots, clip = NominalRobots(1, threads=1), nod()
    qpos = np.concatenate([clip.root_pos[:1], clip.root_quat[:1], clip.joint_pos[:1]], axis=1).astype(np.float64)
    robots.reset(qpos, np.zeros((1, 29)), qpos[:, 7:])
    true = robots.read()
    joint_pos = true.joint_pos.copy()
    joint_pos[0, 3] += 0.1
    believed = robot_state(Sensors(**{**vars(true), "joint_pos": joint_pos})).key_pos_w - robot_state(true).key_pos_w
    moved = believed.norm(dim=-1)[0] > 1e-6
    assert moved.nonzero().flatten().tolist() == [3]
    assert torch.allclose(robot_state(true).key_pos_w[0], torch.as_tensor(clip.key_pos[0]), atol=1e-5)


def test_noise_has_the_stated_size_and_none_is_none() -> None:
    rows = 4000
    zero = {"joint_pos": 23, "joint_vel": 23, "base_ang_vel": 3, "base_lin_vel": 3, "base_pos": 3, "joint_torque": 23}
    true = Sensors(
        **{name: np.zeros((rows, width)) for name, width in zero.items()},
        base_quat=np.tile([1.0, 0, 0, 0], (rows, 1)),
        foot_force=np.zeros((rows, 2, 3)),
    )
    normal, noise = np.random.default_rng(0).standard_normal((rows, draws(23))), SensorNoise()
    noisy, same = add_noise(true, noise, normal), add_noise(true, NO_NOISE, normal)
    for name in ("joint_pos", "joint_vel", "base_ang_vel", "base_lin_vel", "base_pos"):
        assert np.isclose(getattr(noisy, name).std(), getattr(noise, name), rtol=0.05)
        assert not np.any(getattr(same, name))
    assert np.isclose(2 * noisy.base_quat[:, 1:].std(), noise.base_quat, rtol=0.05)


def test_an_episode_does_not_depend_on_what_runs_beside_it(policy_folder: Callable[..., Path]) -> None:
    """Same motion and seed, alone and among others: the same rollout to the last bit but rounding."""
    policies = {"p": ExportedPolicy.load(policy_folder(gain=0.02))}
    clips = {clip.name: clip for clip in (nod("a", 12), nod("b", 18))}
    wanted = Episode("one", "p", "a", 3)
    make = lambda count: NominalRobots(count, threads=1)  # noqa: E731
    others = [Episode("x", "p", "b", 3), wanted, Episode("y", "p", "a", 4)]
    alone = run_episodes(make, [wanted], policies, clips, SensorNoise())[0]
    among = run_episodes(make, others, policies, clips, SensorNoise())
    assert [rollout.frames for rollout in among] == [18, 12, 12]
    assert np.allclose(alone.joint_pos, among[1].joint_pos, atol=1e-5)
    assert not np.allclose(among[1].joint_pos, among[2].joint_pos, atol=1e-5)


def test_a_robot_that_lies_stops_and_one_that_stands_goes_on(policy_folder: Callable[..., Path]) -> None:
    """A policy of wild targets falls before the clip ends; the blind one stands for half a second."""
    wild, calm = policy_folder("wild", gain=5.0), policy_folder("calm")
    policies = {"wild": ExportedPolicy.load(wild), "calm": ExportedPolicy.load(calm)}
    clips = {"nod": nod("nod", 80), "short": nod("short", 25)}
    episodes = [Episode("w", "wild", "nod", 0), Episode("c", "calm", "short", 0)]
    make = lambda count: NominalRobots(count, threads=1)  # noqa: E731
    fell, stood = run_episodes(make, episodes, policies, clips, NO_NOISE, StartNoise(0.0, 0.0))
    assert fell.frames < 80 and stood.frames == 25
    assert stood.foot_force[10:, :, 2].sum(axis=1) == pytest.approx(33.34 * 9.81, rel=0.1)


@pytest.mark.parametrize(("degrees", "drop", "falls"), [(59, 0.34, False), (61, 0.0, True), (0, 0.36, True)])
def test_a_robot_falls_on_the_robot_where_it_falls_in_training(degrees: float, drop: float, falls: bool) -> None:
    """The frozen evaluation's rule and the training's, on one state, turned about the vertical as well."""
    clip = nod("nod", 3)
    tilt = from_rotation_vector(torch.deg2rad(torch.tensor([[0.0, degrees, 0.0]])))
    about = from_rotation_vector(torch.deg2rad(torch.tensor([[0.0, 0.0, 80.0]])))
    quat = multiply(about, multiply(torch.as_tensor(clip.root_quat[1:2], dtype=torch.float32), tilt))
    robots = NominalRobots(1, threads=1)
    robots.batch.bind("qpos")[:, 2:7] = np.concatenate([[clip.root_pos[1, 2] - drop], quat[0].numpy()])
    true = robots.read()
    ref = MotionLibrary([clip]).frames(torch.zeros(1, dtype=torch.long), torch.full((1,), 0.02))
    assert episodes._fallen(true, [clip], np.array([0]), 1, FALL).tolist() == [falls]
    assert fallen(robot_state(true), ref).tolist() == [falls]


def test_a_policy_of_imu_and_encoders_acts_alike_whatever_odometry_says(tmp_path: Path) -> None:
    """Also where it says nothing: readings that the contract does not name are not looked at."""
    size = sum(size for _, size in parts(["imu"], 23, len(AHEAD)))
    shape = Shape(size, critic_observation=1, actions=23, hidden=(8,), ahead=AHEAD, terms=("imu",))
    export_policy(tmp_path, Policy(new_actor(shape), {}, shape))
    policy, clip, first = ExportedPolicy.load(tmp_path), nod(), np.array([0])
    assert policy.sensors == ("imu", "heading", "encoders") and policy.ahead == len(AHEAD)
    assert json.loads((tmp_path / "contract.json").read_text())["sensors"] == list(policy.sensors)
    robots = NominalRobots(1, threads=1)
    qpos = np.concatenate([clip.root_pos[:1], clip.root_quat[:1], clip.joint_pos[:1]], axis=1).astype(np.float64)
    robots.reset(qpos, np.random.default_rng(0).normal(0, 0.1, (1, 29)), qpos[:, 7:])
    sensors, library = robots.read(), reference_library(policy, [clip])
    nothing = replace(sensors, base_pos=np.full((1, 3), np.nan), base_lin_vel=np.full((1, 3), np.nan))
    steps = [PolicyRunner(policy, library, [clip.name]).step(first, 0, read) for read in (sensors, nothing)]
    assert np.array_equal(steps[0][0], steps[1][0]) and np.isfinite(steps[1][1].target).all()


def test_a_contract_that_names_other_sensors_than_its_terms_take_is_refused(policy_folder: Callable[..., Path]) -> None:
    path = policy_folder() / "contract.json"
    stated = json.loads(path.read_text())
    path.write_text(json.dumps(stated | {"sensors": ["imu", "encoders"]}))
    with pytest.raises(BadInput, match=r"sensors: expected imu, heading, .*Export it with this version"):
        ExportedPolicy.load(path.parent)
    del stated["sensors"]  # as before there was a choice
    path.write_text(json.dumps(stated))
    assert "place" in ExportedPolicy.load(path.parent).sensors
