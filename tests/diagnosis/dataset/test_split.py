"""Held-out rollouts: whole motions of every cluster, so that no repeat of a fitted motion is among them."""

import re

import mujoco
import numpy as np
import pytest

from bumblebee.diagnosis.dataset.session import make_session
from bumblebee.diagnosis.dataset.split import split
from bumblebee.diagnosis.report.prediction_error import HORIZONS, horizon_windows
from bumblebee.diagnosis.simulation.windows import choose_starts
from bumblebee.diagnosis.thresholds.dataset import Split
from bumblebee.measured.rollout import Rollout
from tests.diagnosis import arm


def rollout(name: str, cluster: str | None = None, motion: str | None = None) -> Rollout:
    meta = {k: v for k, v in (("cluster", cluster), ("motion", motion)) if v is not None}
    zeros = np.zeros((3, 1))
    return Rollout(name, ("j",), 50.0, np.arange(3) / 50, zeros, zeros, joint_target=zeros, meta=meta)


def test_repeats_of_a_motion_stay_on_one_side() -> None:
    made = [rollout(f"{c}-{m}-{k}", c, m) for c in ("c0", "c1", "c2") for m in "abcdef" for k in range(2)]
    train, holdout = split(made, Split())
    assert sorted(train + holdout) == list(range(len(made)))
    sides = [{(made[i].meta["cluster"], made[i].meta["motion"]) for i in side} for side in (train, holdout)]
    assert not sides[0] & sides[1]
    for cluster in ("c0", "c1", "c2"):
        assert sum(made[i].meta["cluster"] == cluster for i in holdout) == 4


@pytest.mark.parametrize(("count", "held"), [(1, 0), (2, 1), (3, 1), (4, 1), (6, 2), (40, 10)])
def test_without_names_every_fourth_rollout_is_held_out(count: int, held: int) -> None:
    train, holdout = split([rollout(f"r{i:02d}") for i in range(count)], Split())
    assert (len(train), len(holdout)) == (count - held, held)


def test_every_horizon_compares_the_state_at_its_own_end() -> None:
    rollouts = arm.simulate({}, count=2, seconds=3.0)
    session = make_session(mujoco.MjSpec.from_string(arm.XML), rollouts, "arm", "memory")
    assert re.fullmatch(
        r"<Session '[^']*': 2 rollouts \(1 held out\), 0 set aside; \S+ s at \d+ Hz; joints .*>", repr(session)
    )
    windows = horizon_windows(session, [0, 1], budget=8).windows
    assert set(windows) == set(HORIZONS)
    for name, part in windows.items():
        np.testing.assert_allclose(part.out_time[:, -1], float(name), atol=1e-9)
        assert part.out_time.shape[1] == 1


def test_a_long_rollout_gets_no_more_windows_than_the_others() -> None:
    time = np.arange(5000) / 50
    zeros = np.zeros((5000, 1))
    long = Rollout("long", ("j",), 50.0, time, zeros, zeros, joint_target=zeros)
    short = [
        Rollout(f"s{k}", ("j",), 50.0, time[:n], zeros[:n], zeros[:n], joint_target=zeros[:n])
        for k, n in enumerate((200, 200, 40))
    ]
    count = np.bincount([i for i, _, _ in choose_starts([long, *short], range(4), 0.2, 40)])
    assert count.sum() == 40 and count[:3].max() - count[:3].min() <= 1 and count[3] < 5
    assert len(choose_starts([long, *short], range(4), 0.2, 3)) == 3
    every = choose_starts([long, *short], range(4), 0.2, 10**6)
    assert len(every) == len(choose_starts([long], [0], 0.2, 10**6)) + sum(
        len(choose_starts([s], [0], 0.2, 10**6)) for s in short
    )


def test_the_same_commands_under_other_names_are_repeats() -> None:
    rng, time = np.random.default_rng(0), np.arange(100) / 50
    paths = [np.sin(k * time + k)[:, None] for k in (1, 2, 3, 4)]
    made = []
    for day in range(2):
        for k, path in enumerate(paths):
            sent = path + 0.02 * rng.standard_normal(path.shape)
            made.append(
                Rollout(f"{day}-{k}", ("j",), 50.0, time, sent, sent, joint_target=sent, meta={"motion": f"{day}{k}"})
            )
    train, holdout = split(made, Split())
    assert not {i % 4 for i in train} & {i % 4 for i in holdout}
