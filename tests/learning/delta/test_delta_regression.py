"""The delta action by regression: what it finds, and that it finds nothing where nothing is missing."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
import torch

from bumblebee.learning.delta import Recordings, compare, learn_delta, regression, replay_error, stack, total_frames
from bumblebee.learning.delta.action import DeltaConfig, RegressionConfig
from bumblebee.learning.delta.least_squares import System, misfit, solve
from bumblebee.learning.delta.regression import Windows, off, replay
from bumblebee.robot.facts import ANKLE_JOINTS
from bumblebee.sim.engine_choice import make_engine
from bumblebee.sim.sensors import load_model
from tests.learning.swaying import ANKLES, record, weakened

NO_OFFSET = torch.zeros(23)
CONFIG = DeltaConfig(num_envs=60, regression=RegressionConfig(windows=300, passes=3, nudges=(0.1,), folds=6))


def recordings(share: float, seed: int = 0, noise: float = 0.0) -> Recordings:
    """Recordings of a robot whose ankle pitch motors have that share of their gains; `noise` [rad, rad/s]."""
    rollouts = record(24, 30, weakened(share, ANKLES), ANKLES, seed)
    rng = np.random.default_rng(seed)
    for rollout in rollouts:
        for column in (rollout.joint_pos, rollout.joint_vel):
            column += noise * rng.normal(size=column.shape).astype(column.dtype)
    return stack(rollouts, load_model())


@pytest.fixture(scope="module")
def weak() -> Recordings:
    return recordings(0.6)


def test_the_correction_of_weak_ankles_is_found_and_holds_on_other_rollouts(weak: Recordings) -> None:
    steps = []
    engine = make_engine("mujoco", load_model(), CONFIG.num_envs, 1)
    delta, table = learn_delta(engine, weak, CONFIG, NO_OFFSET, lambda frames, note: steps.append(frames))
    assert sum(steps) == total_frames(CONFIG) == 3 * 300 * 3 * 9
    assert list(table["pass"]) == [1, 2, 3]
    assert (table["held_out"] < 0.6).all()
    assert table["left"].iloc[-1] < 0.3
    assert delta.hidden == ()
    judge, other = make_engine("mujoco", load_model(), 12, 1), recordings(0.6, seed=1)
    gain = compare(
        replay_error(judge, other, NO_OFFSET, None), replay_error(judge, other, NO_OFFSET, delta), other.motions
    )
    assert gain.change["0.2"]["with"] < 0.5 * gain.change["0.2"]["without"]


def test_corrections_that_are_large_come_from_changes_as_large() -> None:
    # Ankles that push against the floor: a small change of their targets says little of what a large one does.
    pushing = stack(record(24, 30, weakened(0.6, ANKLES), ANKLES, sway=1.5), load_model())
    engine, tables = make_engine("mujoco", load_model(), CONFIG.num_envs, 1), []
    for nudges in ((0.03,), RegressionConfig().nudges):
        config = replace(CONFIG, regression=replace(CONFIG.regression, nudges=nudges))
        tables.append(learn_delta(engine, pushing, config, NO_OFFSET)[1])
    small, chosen = tables
    assert chosen["nudge"].unique().tolist() == [0.4]
    assert chosen["held_out"].iloc[0] < 0.8 * small["held_out"].iloc[0]


def test_a_robot_as_declared_is_not_corrected() -> None:
    engine = make_engine("mujoco", load_model(), CONFIG.num_envs, 1)
    config = replace(CONFIG, regression=replace(CONFIG.regression, nudges=RegressionConfig().nudges))
    delta, table = learn_delta(engine, recordings(1.0, noise=0.001), config, NO_OFFSET)
    assert len(table) == 1
    assert table["held_out"].iloc[0] > 1.0 - 2.0 * table["held_out_se"].iloc[0]
    assert all(float(own.detach().abs().max()) == 0.0 for own in delta.network[1].parameters())


def test_one_rollout_alone_leaves_nothing_to_judge_by(weak: Recordings) -> None:
    one = Recordings(
        weak.qpos[:30],
        weak.qvel[:30],
        weak.targets[:30],
        weak.start[:1],
        weak.length[:1],
        weak.ids[:1],
        weak.motions[:1],
    )
    _, table = learn_delta(make_engine("mujoco", load_model(), 60, 1), one, CONFIG, NO_OFFSET)
    assert table["held_out"].tolist() == [1.0]


def test_repeats_of_a_motion_are_left_out_together(weak: Recordings) -> None:
    """One motion leaves nothing to judge by, however often it was recorded; without names likewise."""
    engine = make_engine("mujoco", load_model(), 60, 1)
    for name in ("kick", ""):
        same = replace(weak, motions=(name,) * len(weak.ids))
        delta, table = learn_delta(engine, same, CONFIG, NO_OFFSET)
        assert table["held_out"].tolist() == [1.0]
        assert float(delta.network[1].weight.detach().abs().max()) == 0.0
    pairs = replace(weak, motions=tuple(f"m{i // 2}" for i in range(len(weak.ids))))
    rows = weak.start.clone()
    assert pairs.motion(rows).tolist() == [i // 2 for i in range(len(weak.ids))]


def test_where_every_replay_blows_up_nothing_is_corrected(weak: Recordings) -> None:
    broken = Recordings(
        weak.qpos, torch.full_like(weak.qvel, torch.nan), weak.targets, weak.start, weak.length, weak.ids, weak.motions
    )
    delta, table = learn_delta(make_engine("mujoco", load_model(), 60, 1), broken, CONFIG, NO_OFFSET)
    assert table["held_out"].tolist() == [1.0]
    assert float(delta.network[1].weight.detach().abs().max()) == 0.0


def test_where_nothing_is_missed_or_no_target_matters_nothing_is_corrected(
    weak: Recordings, monkeypatch: pytest.MonkeyPatch
) -> None:
    def exact(*arguments: object, missed: float, effect: float) -> Windows:
        windows = replay(*arguments)
        return replace(windows, missed=missed * windows.missed, effect=effect * windows.effect)

    for missed, effect in ((0.0, 1.0), (1.0, 0.0)):
        monkeypatch.setattr(regression, "replay", partial(exact, missed=missed, effect=effect))
        delta, table = learn_delta(make_engine("mujoco", load_model(), 60, 1), weak, CONFIG, NO_OFFSET)
        assert len(table) == 1
        assert float(delta.network[1].weight.detach().abs().max()) == 0.0


def test_a_correction_under_which_every_replay_blows_up_is_taken_back(
    weak: Recordings, monkeypatch: pytest.MonkeyPatch
) -> None:
    def unstable(*arguments: object) -> Windows:
        windows = replay(*arguments)
        return windows if arguments[5] is None else replace(windows, missed=torch.nan * windows.missed)

    monkeypatch.setattr(regression, "replay", unstable)
    delta, table = learn_delta(make_engine("mujoco", load_model(), 60, 1), weak, CONFIG, NO_OFFSET)
    assert len(table) == 1 and table["held_out"].iloc[0] < 0.6
    assert float(delta.network[1].weight.detach().abs().max()) == 0.0


def test_influence_is_the_change_for_a_radian(weak: Recordings) -> None:
    rows = weak.windows(3, stride=20)
    engine = make_engine("mujoco", load_model(), 16, 1)  # other than the windows' number: the last batch is filled up
    windows = replay(engine, weak, rows, CONFIG, NO_OFFSET, None, 0.05)
    assert windows.effect.shape == (len(rows), 58, len(ANKLE_JOINTS))
    pitch = ANKLE_JOINTS.index("left_ankle_pitch_joint")
    moved = windows.effect[:, 12 + ANKLES[0], pitch]
    assert (moved > 0).all()
    assert (windows.effect[:, 12 + ANKLES[1], pitch].abs() < moved).float().mean() > 0.9
    assert windows.owner.tolist() == weak.motion(rows).tolist()


def test_nothing_is_missed_where_the_recording_is_the_simulators_own() -> None:
    own = stack(record(2, 10), load_model())
    engine = make_engine("mujoco", load_model(), 2, 1)
    engine.reset(torch.arange(2), own.qpos[[3, 13]], own.qvel[[3, 13]], own.targets[[2, 12]])
    assert float(off(engine.state(), own.qpos[[3, 13]], own.qvel[[3, 13]]).abs().max()) < 1e-5
    turned = own.qpos[[3, 13]].clone()
    turned[:, 0] += 0.1
    missed = off(engine.state(), turned, own.qvel[[3, 13]])
    torch.testing.assert_close(missed[:, :3].norm(dim=1), torch.full((2,), 0.1))


def test_the_solution_is_that_of_weighted_least_squares() -> None:
    generator = torch.Generator().manual_seed(0)
    features = torch.randn(80, 3, generator=generator, dtype=torch.float64)
    effect = torch.randn(80, 5, 2, generator=generator, dtype=torch.float64)
    weight = torch.rand(80, generator=generator, dtype=torch.float64)
    true = torch.randn(3, 2, generator=generator, dtype=torch.float64)
    missed = torch.einsum("nma,na->nm", effect, features @ true)
    system = System(features, missed, effect, weight, torch.zeros(80))
    torch.testing.assert_close(solve(system, 1e-12), true)
    assert misfit(system, true) < 1e-20
    noisy = System(features, missed + torch.randn(80, 5, generator=generator, dtype=torch.float64), effect, weight,
                   torch.zeros(80))  # fmt: skip
    best = solve(noisy, 1e-12)
    assert misfit(noisy, best) < min(misfit(noisy, best + 0.01), misfit(noisy, best - 0.01), misfit(noisy, true))
    assert float(solve(noisy, 100.0).norm()) < 0.1 * float(best.norm())
