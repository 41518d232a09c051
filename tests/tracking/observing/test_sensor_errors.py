"""Errors of sensors that stay through an episode: what is seen follows their law, and nothing else changes."""

import math
from dataclasses import replace

import pytest
import torch

from bumblebee.learning.world_model.collector import Collector
from bumblebee.learning.world_model.dynamics import Dynamics
from bumblebee.learning.world_model.imagination import Imagination
from bumblebee.learning.world_model.memory import Memory
from bumblebee.sim.engine import RobotState
from bumblebee.sim.rotations import conjugate, from_rotation_vector, multiply, rotate
from bumblebee.tracking.config import EnvConfig, ObservationConfig, Randomisation, SensorConfig
from bumblebee.tracking.env import TrackingEnv
from tests.learning.tiny import env_of

EXACT = EnvConfig(
    num_worlds=4,
    threads=1,
    observation=ObservationConfig(("imu",)),
    observation_noise=0.0,
    randomisation=Randomisation(push=0.0),
)
ERRING = replace(EXACT, sensors=SensorConfig(encoder_offset=0.02, imu_offset=0.03, gyro_bias=0.05))

PLACED = replace(EXACT, observation=ObservationConfig(("demo",)))
DRIFTING = replace(PLACED, sensors=SensorConfig(odometry_scale=0.1, odometry_heading=0.05))


def part(env: TrackingEnv, seen: torch.Tensor, name: str) -> torch.Tensor:
    """The entries of an observation (..., D) that have this name."""
    names = [own for own, _ in env.groups["policy"].parts]
    sizes = [size for _, size in env.groups["policy"].parts]
    return seen[..., : sum(sizes)].split(sizes, dim=-1)[names.index(name)]


def test_encoders_gyro_and_gravity_err_as_declared_and_reward_and_critic_know_the_truth() -> None:
    env, other = env_of(ERRING), env_of(EXACT)
    assert env.errors is not None
    first = env.errors.now.clone()
    assert first.abs().gt(0).all() and (first.abs() <= env.errors.most).all()
    for _ in range(5):
        state, seen = env.now[0], env.get_observations()
        offset, tilt, bias = first.split((23, 3, 3), dim=-1)
        back = conjugate(from_rotation_vector(tilt))
        torch.testing.assert_close(part(env, seen["policy"], "joint_pos"), state.joint_pos + offset)
        gyro = rotate(back, state.root_ang_vel_b) + bias
        torch.testing.assert_close(part(env, seen["policy"], "root_ang_vel_b"), gyro)
        down = torch.tensor([0.0, 0.0, -1.0]).expand(4, 3)
        gravity = rotate(multiply(back, conjugate(state.root_quat_w)), down)
        torch.testing.assert_close(part(env, seen["policy"], "gravity_b"), gravity)
        assert torch.equal(seen["critic"], other.get_observations()["critic"])
        (_, reward, done, _), (_, true, _, _) = env.step(torch.zeros(4, 23)), other.step(torch.zeros(4, 23))
        assert torch.equal(reward, true) and not done.any() and torch.equal(env.errors.now, first)


def test_an_episode_that_begins_has_new_errors_and_the_others_keep_theirs() -> None:
    env = env_of(ERRING)
    assert env.errors is not None
    first = env.errors.now.clone()
    env._restart(torch.tensor([True, False, True, False]))
    assert (env.errors.now != first).any(-1).tolist() == [True, False, True, False]
    again = env_of(ERRING)
    again.load_state_dict(env.state_dict())
    assert again.errors is not None and torch.equal(again.errors.now, env.errors.now)


def test_key_bodies_are_where_the_encoders_put_them_and_without_errors_where_they_are() -> None:
    env = env_of(ERRING)
    assert env.errors is not None
    state = env.now[0]
    true = env.errors.read(state, torch.zeros_like(env.errors.now))
    torch.testing.assert_close(true.key_pos_w, state.key_pos_w, atol=1e-5, rtol=1e-5)
    assert (env.errors.read(state, env.errors.now).key_pos_w - state.key_pos_w).norm(dim=-1).amax() > 1e-3


def test_an_imagined_robots_errors_stay_through_its_rollout_and_the_value_sees_the_truth() -> None:
    env = env_of(ERRING)
    memory, shown = Memory(2, torch.zeros(4, 0), env.num_actions), []
    for _ in range(2):
        Collector(env, memory, 0.0)(lambda seen: torch.zeros(len(seen), env.num_actions))

    def act(seen: torch.Tensor) -> torch.Tensor:
        shown.append(seen)
        return torch.zeros(len(seen), env.num_actions)

    model = Dynamics(env.num_actions, (16,), env.dt)
    rollout = Imagination(env, horizon=3).rollout(act, model, memory.starts(8))
    offsets = part(env, torch.stack(shown), "joint_pos") - part(env, rollout.seen, "joint_pos")
    assert offsets.abs().amax() > 0.01 and offsets.abs().amax() <= 0.0201
    torch.testing.assert_close(offsets[1:], offsets[:1].expand(2, -1, -1), atol=1e-4, rtol=0)


def test_a_group_that_is_exact_by_its_own_noise_has_no_errors() -> None:
    env = env_of(replace(ERRING, observation=ObservationConfig(("imu",), noise=0.0)))
    assert torch.equal(env.groups["policy"].noisy, env.groups["policy"].exact)


def travelling(speed: tuple[float, float], robots: int, env: TrackingEnv) -> RobotState:
    """States of robots that go through the plane with this velocity [m/s]."""
    now = env.now[0]
    parts = (now.root_pos_w, now.root_quat_w, now.root_lin_vel_b, now.root_ang_vel_b, now.joint_pos, now.joint_vel)
    many = RobotState(*(part[:1].repeat_interleave(robots, 0) for part in (*parts, now.key_pos_w)))
    world = torch.tensor([*speed, 0.0]).expand(robots, 3)
    return replace(many, root_lin_vel_b=rotate(conjugate(many.root_quat_w), world))


def test_odometry_errs_by_its_scale_and_by_a_heading_that_wanders_as_the_stand_ins() -> None:
    env, robots, steps = env_of(DRIFTING), 2000, 50
    assert env.errors is not None
    state, errors = travelling((1.0, 0.0), robots, env), env.errors.draw(robots)
    assert errors[:, -3:].eq(0).all()
    for _ in range(steps):
        errors = env.errors.after(errors, (state, state), 0.02)
    scale, heading, shift = errors[:, -4], errors[:, -3], errors[:, -2:]
    assert scale.std() == pytest.approx(0.1, rel=0.1) and heading.std() == pytest.approx(0.05, rel=0.1)
    assert (shift[:, 0] - scale).abs().amax() < 0.05  # a metre in a second
    assert shift[:, 1].std() == pytest.approx(0.05 / math.sqrt(3), rel=0.15)  # the integral of a random walk
    read = env.errors.read(state, errors)
    torch.testing.assert_close(read.root_pos_w - state.root_pos_w, torch.nn.functional.pad(shift, (0, 1)))
    keys = (read.key_pos_w - state.key_pos_w)[..., :2]
    torch.testing.assert_close(keys, shift[:, None].expand_as(keys), atol=1e-4, rtol=0)


def test_odometry_drifts_in_what_the_policy_sees_alone_from_nothing_at_each_start() -> None:
    env, other = env_of(DRIFTING), env_of(PLACED)
    assert env.errors is not None and env.errors.now[:, -3:].eq(0).all()
    for _ in range(5):
        (_, reward, _, _), (_, true, _, _) = env.step(torch.zeros(4, 23)), other.step(torch.zeros(4, 23))
        assert torch.equal(reward, true)
    seen = env.get_observations()
    assert torch.equal(seen["critic"], other.get_observations()["critic"])
    assert not torch.equal(seen["policy"], other.get_observations()["policy"])
    assert env.errors.now[:, -2:].ne(0).any(-1).all()
    env._restart(torch.tensor([True, False, False, False]))
    assert env.errors.now[0, -3:].eq(0).all() and env.errors.now[1:, -2:].ne(0).any(-1).all()


def test_without_drift_the_other_errors_are_drawn_as_before_to_the_bit() -> None:
    plain, both = env_of(ERRING), env_of(replace(ERRING, sensors=replace(ERRING.sensors, odometry_scale=0.1)))
    assert plain.errors is not None and both.errors is not None
    given = [errors.draw(3, torch.Generator().manual_seed(1)) for errors in (plain.errors, both.errors)]
    assert torch.equal(given[0], given[1][:, :29]) and given[0].shape == (3, 29) and given[1].shape == (3, 33)
    state = plain.now[0]
    assert plain.errors.after(plain.errors.now, (state, state), 0.02) is plain.errors.now
    torch.manual_seed(1)
    drawn = plain.errors.draw(3)
    torch.manual_seed(1)
    assert torch.equal(plain.errors.under_way(3), drawn)


def test_an_imagined_robot_has_a_worlds_drift_of_now_and_drifts_on() -> None:
    place = ObservationConfig(("target_root_pos_b",))
    env = env_of(replace(DRIFTING, observation=place, sensors=SensorConfig(odometry_scale=0.1)))
    assert env.errors is not None
    memory, shown = Memory(2, torch.zeros(4, 0), env.num_actions), []
    for _ in range(2):
        Collector(env, memory, 0.0)(lambda seen: torch.zeros(len(seen), env.num_actions))
    env.errors.now[:, -2:] = torch.tensor([0.3, 0.4])

    def act(seen: torch.Tensor) -> torch.Tensor:
        shown.append(seen)
        return torch.zeros(len(seen), env.num_actions)

    model = Dynamics(env.num_actions, (16,), env.dt)
    rollout = Imagination(env, horizon=3).rollout(act, model, memory.starts(8))
    far = (torch.stack(shown) - rollout.seen).norm(dim=-1)
    torch.testing.assert_close(far[0], torch.full((8,), 0.5), atol=1e-4, rtol=0)
    assert (far[1:] - far[:1]).abs().gt(1e-7).any() and (far - 0.5).abs().amax() < 0.05
