"""Reward of following under a table of rewards, without training."""

import pandas as pd
import pytest

from benchmarks.study.printed_rewards import PHYSICS_HZ, PRINTED, by_policy, earned, on_reference
from benchmarks.study.reward_arms import arms
from benchmarks.study.reward_ladder import worth
from bumblebee.learning import pretrained
from bumblebee.learning.policy import load_policy
from bumblebee.learning.rollout import Manner
from bumblebee.motion.clip import Clip
from bumblebee.motion.embedded import EmbeddedConfig, make_library
from bumblebee.sim.engine_choice import make_engine
from bumblebee.tracking.config import EnvConfig, RewardConfig
from bumblebee.tracking.model import task_model
from bumblebee.tracking.rewards import ERRORS, PAPER_WEIGHTS
from bumblebee.tracking.sampling.library import MotionLibrary


@pytest.fixture(scope="module")
def clips() -> list[Clip]:
    return make_library(EmbeddedConfig(families=("stand",), limit=2))


def rows(clips: list[Clip], policy: bool, rewards: RewardConfig = PRINTED) -> pd.DataFrame:
    actor = load_policy(pretrained.FOLDER)
    library = MotionLibrary(clips, actor.shape.ahead)
    engine = make_engine("mujoco", task_model(EnvConfig(physics_hz=PHYSICS_HZ)), len(clips), 1)
    move = by_policy(actor, Manner(actor.shape.seen), len(clips), library) if policy else on_reference
    return earned(clips, library, engine, move, rewards)


def test_the_reference_has_no_error_and_needs_no_torque(clips: list[Clip]) -> None:
    table = rows(clips, policy=False)
    assert list(table["name"]) == [clip.name for clip in clips]
    assert (table["frames"] >= [clip.frames - 2 for clip in clips]).all()
    for name in ERRORS:
        assert table[name].to_numpy() == pytest.approx(PAPER_WEIGHTS[name], abs=0.02)
    assert (table["torque"] == 0).all()
    assert (table["action_rate"] < 0).all()  # a motion moves its targets


def test_a_policy_earns_less_than_the_reference(clips: list[Clip]) -> None:
    policy, reference = rows(clips, policy=True), rows(clips, policy=False)
    terms = [c for c in reference if c not in ("name", "frames")]
    assert (policy["frames"] == reference["frames"]).all()  # it follows these to their end
    assert (policy[terms].sum(axis=1) < reference[terms].sum(axis=1)).all()
    assert (policy["torque"] < 0).all()


def test_the_ladder_goes_from_the_printed_table_to_ours(clips: list[Clip]) -> None:
    steps = arms()
    assert steps["printed"].rewards == PRINTED
    assert steps["ours"].rewards == RewardConfig()
    counts = [len(arm.rewards.weights) for arm in list(steps.values())[:-1]]
    assert counts == sorted(counts)
    whole, _ = worth(steps["ramped"], clips)
    printed, below = worth(steps["printed"], clips)
    assert whole.value == pytest.approx(printed.value)  # a ramp's end is the whole table
    assert below in (0.0, 0.5, 1.0)
