"""The delta action: its rewards by hand, what an untrained one does, when one is kept."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from bumblebee.errors import BadInput
from bumblebee.learning.delta import DeltaEnv, Recordings, compare, replay_error, rewards, stack, train_delta
from bumblebee.learning.delta.action import (
    DELTA_PPO,
    DeltaAction,
    DeltaConfig,
    action_adapter,
    layout,
    load_delta,
    make_network,
    save_delta,
)
from bumblebee.robot.facts import ANKLE_JOINTS, joint_names
from bumblebee.sim.engine import RobotState
from bumblebee.sim.engine_choice import make_engine
from bumblebee.sim.mujoco_cpu import MujocoCpu
from bumblebee.sim.sensors import load_model
from tests.learning.swaying import record

NO_OFFSET = torch.zeros(23)


@pytest.fixture(scope="module")
def recordings() -> Recordings:
    return stack(record(), load_model())


def test_rewards_by_hand() -> None:
    x, ref = torch.tensor([[0.3, 0.4]]), torch.zeros(1, 2)
    assert rewards.closeness(x, ref).item() == pytest.approx(np.exp(-4 * 0.25), rel=1e-6)
    assert rewards.norm(x).item() == pytest.approx(0.5)
    assert rewards.squared_norm(x).item() == pytest.approx(0.25)
    turn = torch.tensor([[np.cos(0.1), np.sin(0.1), 0.0, 0.0]], dtype=torch.float32)
    still = torch.tensor([[1.0, 0.0, 0.0, 0.0]])
    assert rewards.rotation_closeness(turn, still).item() == pytest.approx(np.exp(-4 * 0.2**2), rel=1e-4)


def test_a_limit_that_the_robot_was_at_too_costs_nothing() -> None:
    low, high = -torch.ones(23), torch.ones(23)
    values, recorded = torch.zeros(4, 23), torch.zeros(4, 23)
    values[1:, 2] = 1.2
    recorded[2:, 2] = 1.1
    values[3, 5] = -2.0
    assert rewards.beyond_alone(values, recorded, low, high).tolist() == [0.0, 1.0, 0.0, 1.0]


def test_recordings_shorter_than_an_episode_are_one_line(recordings: Recordings) -> None:
    engine = MujocoCpu(load_model(), 2, threads=1)
    with pytest.raises(BadInput, match=r"expected one of more than 3 s, came 3 of at most 1\.4 s"):
        DeltaEnv(engine, recordings, DeltaConfig(num_envs=2, episode_seconds=3.0), NO_OFFSET)


@pytest.mark.parametrize(("beyond", "penalty"), [(0, 0.0), (1, 1.0), (5, 1.0), (23, 1.0)])
def test_the_limit_rows_say_whether_any_joint_is_beyond_however_many(beyond: int, penalty: float) -> None:
    """The table's 1(x not in [x_min, x_max]), as the tracking task has it; not a share of the 23 joints."""
    values = torch.zeros(2, 23)
    values[0, :beyond] = -1.5
    assert rewards.beyond(values, -torch.ones(23), torch.ones(23)).tolist() == [penalty, 0.0]


def test_a_rollout_that_is_shorter_than_a_window_has_none() -> None:
    """A log that ends where the operator stopped is no reason for the others to be lost."""
    rows = torch.zeros(70, 1)
    recordings = Recordings(
        rows, rows, rows, torch.tensor([0, 10]), torch.tensor([10, 60]), ("short", "long"), ("a", "b")
    )
    assert recordings.windows(50, 5).tolist() == [10, 15]


def test_windows_stay_inside_their_rollout(recordings: Recordings) -> None:
    rows = recordings.windows(50, 5)
    assert len(rows) == 3 * 4
    assert torch.equal(recordings.owner(rows), recordings.owner(rows + 50))


def test_a_missing_column_is_named() -> None:
    rollout = record(worlds=1, ticks=5)[0]
    object.__setattr__(rollout, "base_lin_vel", None)
    with pytest.raises(BadInput, match="r0: column base_lin_vel: expected a logged column"):
        stack([rollout], load_model())


def test_odometry_stands_in_for_a_missing_position(recordings: Recordings) -> None:
    """Integrated velocity follows the true path, and the start height comes from the soles."""
    rollout = record(worlds=1, ticks=30)[0]
    truth = rollout.base_pos.copy()
    object.__setattr__(rollout, "base_pos", None)
    path = stack([rollout], load_model()).qpos[:, :3].numpy()
    np.testing.assert_allclose(path[0, 2], truth[0, 2], atol=2e-3)
    np.testing.assert_allclose(path - path[0], truth - truth[0], atol=5e-3)


def test_replay_of_its_own_simulator_is_exact_and_of_another_is_not(recordings: Recordings) -> None:
    same = replay_error(MujocoCpu(load_model(), 8, threads=1), recordings, NO_OFFSET, None, stride=10)
    model = load_model()
    model.actuator_gainprm[:, 0] *= 0.8
    other = replay_error(MujocoCpu(model, 8, threads=1), recordings, NO_OFFSET, None, stride=10)
    assert np.nanmax(same["0.2"]) < 2e-3  # float32 states and a cold solver are all that differs
    assert np.nanmin(other["0.2"]) > 5 * np.nanmax(same["0.2"])


def test_an_untrained_delta_corrects_nothing_and_a_trained_one_only_its_joints(recordings: Recordings) -> None:
    network = make_network((16,), 4)
    delta = DeltaAction(network, ANKLE_JOINTS, limit=0.1)
    state = RobotState(*(torch.randn(5, *shape) for shape in ((3,), (4,), (3,), (3,), (23,), (23,), (14, 3))))
    targets = torch.randn(5, 23)
    assert torch.equal(delta(state, targets), targets)
    torch.nn.init.normal_(network[-1].weight, std=50.0)
    change = delta(state, targets) - targets
    ankles = [joint_names().index(name) for name in ANKLE_JOINTS]
    others = [i for i in range(23) if i not in ankles]
    assert change[:, others].abs().max() == 0
    assert 0 < change[:, ankles].abs().max() <= 0.1 + 1e-6


def test_the_adapter_changes_actions_by_the_same_targets() -> None:
    network = make_network((16,), 4)
    torch.nn.init.normal_(network[-1].weight)
    delta, scale = DeltaAction(network, ANKLE_JOINTS, 0.1), torch.linspace(0.1, 0.3, 23)
    state = RobotState(*(torch.randn(2, *shape) for shape in ((3,), (4,), (3,), (3,), (23,), (23,), (14, 3))))
    reference, action = torch.randn(2, 23), torch.randn(2, 23)
    adapted = reference + scale * action_adapter(delta, scale)(state, reference, action)
    torch.testing.assert_close(adapted, delta(state, reference + scale * action))


def test_the_adapter_works_where_the_actions_are() -> None:
    """On any device, the delta's own tensors staying where they were; `meta` stands for a GPU here."""
    delta = DeltaAction(make_network((16,), 4), ANKLE_JOINTS, 0.1)
    shapes = ((3,), (4,), (3,), (3,), (23,), (23,), (14, 3))
    state = RobotState(*(torch.empty(2, *shape, device="meta") for shape in shapes))
    adapt = action_adapter(delta, torch.ones(23))
    there = adapt(state, torch.empty(2, 23, device="meta"), torch.empty(2, 23, device="meta"))
    assert there.device.type == "meta" and next(delta.network.parameters()).device.type == "cpu"


def test_saved_and_loaded_alike_and_withheld_unless_promoted(tmp_path: Path) -> None:
    network = make_network((16, 8), 4)
    torch.nn.init.normal_(network[-1].weight)
    delta = DeltaAction(network, ANKLE_JOINTS, 0.1)
    save_delta(tmp_path, delta, {"promoted": False})
    assert load_delta(tmp_path) is None
    loaded = load_delta(tmp_path, promoted_only=False)
    seen = torch.randn(3, sum(n for _, n in layout()))
    torch.testing.assert_close(loaded.network(seen), network(seen))


def test_perfect_tracking_earns_the_task_rewards(recordings: Recordings) -> None:
    """In its own simulator a zero correction earns nearly all of the task rows (3.5 a second) and loses nobody."""
    config = DeltaConfig(num_envs=4, episode_seconds=0.4)
    env = DeltaEnv(MujocoCpu(load_model(), 4, threads=1), recordings, config, NO_OFFSET)
    for _ in range(10):
        _, reward, done, extras = env.step(torch.zeros(4, 4))
        assert not done.any() and extras["log"]["lost"] == 0
        assert (reward > 0.9 * 3.5 * 0.02).all()
    for _ in range(10):
        _, _, done, extras = env.step(torch.zeros(4, 4))
    assert done.all() and extras["time_outs"].all()


def test_promotion_needs_an_interval_below_zero() -> None:
    rng = np.random.default_rng(0)
    before = rng.uniform(0.05, 0.1, 12)
    base = {"0.2": before, "1.0": 2 * before}

    def scaled(factor: np.ndarray) -> dict[str, np.ndarray]:
        return {h: v * factor for h, v in base.items()}

    motions = [f"m{i // 2}" for i in range(12)]
    assert compare(base, scaled(0.8 + 0.02 * rng.normal(size=12)), motions).promoted
    assert not compare(base, scaled(1.0 + 0.05 * rng.normal(size=12)), motions).promoted
    assert not compare(base, scaled(1.3 + 0.02 * rng.normal(size=12)), motions).promoted
    assert compare(base, base, motions).reason == "nothing was found that it should correct"
    worse_soon = {"0.2": before * 1.2, "1.0": before * 1.5}
    assert not compare(base, worse_soon, motions).promoted


def test_repeats_of_a_motion_are_no_further_evidence() -> None:
    """Two motions, one gains much and one little, each recorded twice or often: two numbers, whatever the repeats."""
    for repeats in (1, 2, 8):
        before = np.full(2 * repeats, 0.1)
        gained = np.repeat([0.7, 0.9], repeats)
        judged = compare({"1.0": before}, {"1.0": gained * before}, ["kick"] * repeats + ["bow"] * repeats)
        own = judged.change["1.0"]
        assert (judged.rollouts, judged.motions, judged.promoted) == (2 * repeats, 2, False)
        assert own["relative"] == pytest.approx(-0.2)
        assert own["high"] == pytest.approx(-0.2 + 12.706 * 0.1, abs=1e-3)  # t of one degree of freedom
    one = compare({"1.0": before}, {"1.0": gained * before}, ["kick"] * len(before))
    assert not one.promoted and "of one motion" in one.reason


def test_a_motion_that_was_recorded_more_often_counts_no_more() -> None:
    before = np.full(10, 0.1)
    gained = np.array([0.5] * 8 + [1.1, 1.2])
    judged = compare({"1.0": before}, {"1.0": gained * before}, ["kick"] * 8 + ["bow", "step"])
    assert judged.change["1.0"]["relative"] == pytest.approx(np.mean([-0.5, 0.1, 0.2])) and judged.motions == 3


@pytest.mark.gpu
@pytest.mark.skipif(not torch.cuda.is_available(), reason="needs a GPU")
def test_on_a_gpu_a_delta_is_trained_where_the_engine_is(recordings: Recordings) -> None:
    config = DeltaConfig(num_envs=64, ppo=replace(DELTA_PPO, iterations=1, steps=4), episode_seconds=0.4)
    env = DeltaEnv(make_engine("mujoco_warp", load_model(), 64), recordings, config, NO_OFFSET)
    assert {seen.device.type for seen in env.get_observations().values()} == {"cuda"}
    delta, curve = train_delta(env, config)
    assert np.isfinite(curve["reward"]).all()
    assert next(delta.network.parameters()).device.type == "cpu"
