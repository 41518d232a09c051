"""The filter of H2O: what the shipped policy follows on the declared model is kept, what it cannot is dropped."""

from dataclasses import replace

import numpy as np
import pytest

from bumblebee.measured.rollout import Rollout
from bumblebee.motion.clip import Clip
from bumblebee.motion.embedded import EmbeddedConfig, make_library
from bumblebee.motion.filters.rules import DROP_COLUMNS
from bumblebee.motion.kinematics import make_clip
from bumblebee.robot.facts import joint_names
from tasks.on_robot.stand_in import cut
from tasks.policies.policy_filter import PolicyFilter, judged, loaded, unfollowed


@pytest.fixture(scope="module")
def stand() -> Clip:
    (clip,) = make_library(EmbeddedConfig(families=("stand",), limit=1))
    return cut(clip, 1.0)


def rollout(clip: Clip, frames: int | None = None, off: np.ndarray | float = 0.0) -> Rollout:
    """As if the robot had been `off` (T,) [m] beside the clip."""
    frames = frames or clip.frames
    place = np.array(clip.root_pos[:frames], dtype=np.float64)
    place[:, 1] += np.broadcast_to(off, clip.frames)[:frames]
    more = {"base_pos": place, "base_quat": clip.root_quat[:frames], "joint_pos": clip.joint_pos[:frames]}
    none = np.zeros((frames, len(joint_names())))
    fields = {"joint_vel": none, "joint_target": none, "action": none, **more}
    return Rollout("r", joint_names(), 50.0, np.arange(frames) / 50.0, meta={}, **fields)


def test_a_rollout_fails_at_the_first_frame_whose_mean_distance_is_beyond_the_limit(stand: Clip):
    off = np.linspace(0, 1, stand.frames)
    followed, worst = judged(rollout(stand, off=off), stand, 0.5)
    assert not followed and worst.frame == int(np.flatnonzero(off > 0.5)[0])
    assert worst.value == pytest.approx(off[worst.frame], abs=1e-3) and worst.unit == "m"
    followed, worst = judged(rollout(stand, off=0.4 * off), stand, 0.5)
    assert followed and worst.value == pytest.approx(0.4, abs=1e-3)


def test_a_fall_is_no_following_however_near_it_was(stand: Clip):
    followed, worst = judged(rollout(stand, frames=20), stand, 0.5)
    assert not followed and worst.frame == 20 and "falls" in worst.explanation


def test_a_rollout_that_is_no_number_is_not_followed(stand: Clip):
    off = np.zeros(stand.frames)
    off[10:] = np.nan
    followed, worst = judged(rollout(stand, off=off), stand, 0.5)
    assert not followed and worst.frame == 10


def test_the_shipped_policy_keeps_a_stand_and_drops_a_somersault_on_the_spot(stand: Clip):
    turn = np.linspace(0, 2 * np.pi, stand.frames) / 2
    quat = np.stack([np.cos(turn), 0 * turn, np.sin(turn), 0 * turn], axis=1)
    upright = make_clip("stand", 50.0, stand.root_pos, stand.root_quat, stand.joint_pos)
    flips = make_clip("flip", 50.0, stand.root_pos, quat, stand.joint_pos)
    config = PolicyFilter(source="shipped")
    ticks: list[int] = []
    with loaded(config) as policy:
        found = unfollowed(policy, [upright, flips], config, ticks.append)
    assert list(found) == ["flip"]
    assert tuple(found["flip"]) == DROP_COLUMNS and found["flip"]["rule"] == "policy"
    assert sum(ticks) >= stand.frames


def test_the_verdict_is_the_same_each_time_and_whatever_runs_beside(stand: Clip):
    other = replace(stand, name="other", root_pos=stand.root_pos + np.float32(1.0))
    config = PolicyFilter(source="shipped", distance=1e-4)  # nothing is as near as that: all rows come back
    with loaded(config) as policy:
        alone, beside = unfollowed(policy, [stand], config), unfollowed(policy, [other, stand], config)
    assert alone[stand.name] == beside[stand.name]
