"""Sampling, curriculum and terminations."""

from itertools import pairwise

import numpy as np
import pytest
import torch

from bumblebee.motion.kinematics import make_clip
from bumblebee.robot.facts import stand_pose
from bumblebee.sim.engine import RobotState
from bumblebee.sim.rotations import from_rotation_vector
from bumblebee.tracking.sampling.library import MotionLibrary
from bumblebee.tracking.sampling.sampler import ClipSampler, ClipShares
from bumblebee.tracking.terminations import fallen, key_distance, success_threshold, threshold_at
from tests.tracking.clips import waving

LENGTH = torch.tensor([100, 100, 300])


def test_success_never_takes_a_clip_away() -> None:
    """After ten thousand successes a clip keeps its floor: 0.3 of its length against 1.3 of the untried ones'."""
    sampler = ClipSampler(LENGTH, floor=0.3)
    sampler.update(torch.zeros(10_000, dtype=torch.long), torch.zeros(10_000, dtype=torch.bool))
    assert sampler.probabilities()[0].item() == pytest.approx(0.3 / (0.3 + 1.3 + 3 * 1.3), rel=1e-4)


def test_longer_and_failing_clips_are_drawn_more() -> None:
    """Chances follow length, and failure raises them."""
    sampler = ClipSampler(LENGTH)
    chance = sampler.probabilities()
    assert chance[2] / chance[0] == pytest.approx(3.0)
    for _ in range(30):
        sampler.update(torch.tensor([0, 1]), torch.tensor([True, False]))
    chance = sampler.probabilities()
    assert chance[0] > 3 * chance[1]


def test_updates_in_one_batch_count_each_episode() -> None:
    """Two successes at once leave what two in turn leave."""
    one, two = ClipSampler(LENGTH, memory=0.8), ClipSampler(LENGTH, memory=0.8)
    one.update(torch.tensor([1, 1]), torch.tensor([False, False]))
    for _ in range(2):
        two.update(torch.tensor([1]), torch.tensor([False]))
    assert one.failure[1].item() == pytest.approx(two.failure[1].item()) == pytest.approx(0.64)


def test_draws_are_reproducible_within_the_clip_and_start_at_zero_as_often_as_asked() -> None:
    """Same seed, same draws; frames leave half a second; a fifth of the episodes start at frame 0."""
    sampler = ClipSampler(LENGTH, start_share=0.2)
    clip, frame = sampler.draw(5000, torch.Generator().manual_seed(3))
    again = sampler.draw(5000, torch.Generator().manual_seed(3))
    assert torch.equal(clip, again[0]) and torch.equal(frame, again[1])
    assert (frame <= LENGTH[clip] - 25).all() and (frame >= 0).all()
    assert 0.18 < (frame == 0).float().mean() < 0.24


def test_a_share_of_nought_silences_a_group() -> None:
    """The others have it."""
    sampler = ClipSampler(LENGTH, shares=ClipShares(torch.tensor([0, 1, 0]), torch.tensor([1.0, 0.0])))
    assert sampler.probabilities().tolist() == pytest.approx([0.25, 0.0, 0.75])


FAILURES = [(0.0, 0.0, 0.6), (1.0, 0.0, 0.0), (0.3, 0.3, 0.3), (0.0, 1.0, 1.0)]


@pytest.mark.parametrize("failures", FAILURES)
def test_equal_shares_of_groups_hold_whatever_fails(failures: tuple[float, ...]) -> None:
    """Three groups of one, two and one clips of all lengths: a third of the draws each."""
    sampler = ClipSampler(torch.tensor([100, 50, 30, 300]), shares=ClipShares.equal([0, 1, 1, 2]))
    sampler.failure[:] = torch.tensor([failures[0], failures[1], failures[1], failures[2]])
    chance = sampler.probabilities()
    assert [float(chance[0]), float(chance[1:3].sum()), float(chance[3])] == pytest.approx([1 / 3] * 3)


@pytest.mark.parametrize("failures", FAILURES)
def test_unequal_shares_of_groups_hold_whatever_fails(failures: tuple[float, ...]) -> None:
    """A tenth is a tenth, though the others' clips fail and one's own do not."""
    shares = ClipShares(torch.tensor([0, 1, 1]), torch.tensor([0.9, 0.1]))
    sampler = ClipSampler(LENGTH, shares=shares)
    sampler.failure[:] = torch.tensor(failures)
    assert sampler.probabilities()[0].item() == pytest.approx(0.9)
    drawn, _ = sampler.draw(20_000, torch.Generator().manual_seed(0))
    assert float((drawn > 0).float().mean()) == pytest.approx(0.1, abs=0.01)


def test_within_a_group_longer_and_failing_clips_are_drawn_more() -> None:
    """As without groups: length times (floor + failure)."""
    sampler = ClipSampler(LENGTH, floor=0.3, shares=ClipShares(torch.tensor([1, 0, 0]), torch.tensor([3.0, 1.0])))
    sampler.failure[:] = torch.tensor([0.0, 0.7, 0.2])
    short, long = 100 * 1.0, 300 * 0.5
    assert sampler.probabilities().tolist() == pytest.approx(
        [0.25, 0.75 * short / (short + long), 0.75 * long / (short + long)]
    )


def test_a_group_without_a_clip_leaves_its_share_to_the_others() -> None:
    """A cluster all of whose clips are held out."""
    chance = ClipSampler(LENGTH, shares=ClipShares.equal([0, 3, 0])).probabilities()
    assert chance[1].item() == pytest.approx(0.5) and torch.isfinite(chance).all()
    alone = ClipSampler(LENGTH, shares=ClipShares(torch.zeros(3, dtype=torch.long), torch.tensor([0.9, 0.1])))
    assert torch.equal(alone.probabilities(), ClipSampler(LENGTH).probabilities())


def test_the_curriculum_only_tightens() -> None:
    """From 0.8 to 0.3 m over the first half, then constant."""
    values = [threshold_at(p / 20, 0.8, 0.3, 0.5) for p in range(21)]
    assert values[0] == 0.8 and values[10] == pytest.approx(0.3) == values[20]
    assert all(a >= b for a, b in pairwise(values))


def test_terminations() -> None:
    """A key body .5 m off; a pelvis .4 m too low, a trunk at 61 degrees, no number; at 59, or turned about, no fall."""
    ref = MotionLibrary([waving()]).frames(torch.zeros(7, dtype=torch.long), torch.zeros(7))
    pos, quat, keys = ref.root_pos_w.clone(), ref.root_quat_w.clone(), ref.key_pos_w.clone()
    keys[1, 10, 1] += 0.5
    pos[2, 2] -= 0.4
    for world, turn in ((3, (0.0, 61.0, 0.0)), (5, (-59.0, 0.0, 0.0)), (6, (0.0, 0.0, 120.0))):
        quat[world] = from_rotation_vector(torch.deg2rad(torch.tensor(turn)))
    pos[4] = torch.nan
    zero3, zero = torch.zeros(7, 3), torch.zeros(7, 23)
    state = RobotState(pos, quat, zero3, zero3, zero, zero, keys)
    assert key_distance(state, ref).tolist() == pytest.approx([0, 0.5, 0, 0, 0, 0, 0], abs=1e-6)
    assert fallen(state, ref).tolist() == [False, False, True, True, True, False, False]


@pytest.mark.parametrize(("far", "limit"), [(0.0, 0.4), (0.9, 0.4), (1.1, 0.8)])
def test_motions_that_travel_may_drift_further_whatever_their_name(far: float, limit: float) -> None:
    """0.8 m for walking, 0.4 m for all others; a way back to the start counts."""
    for name, family in (("squat_level1", "squat"), ("walk_in_place", "walk"), ("05_13", "")):
        root_pos = np.array([[0.0, 0.0, 0.8], [far, 0.0, 0.8], [0.0, 0.0, 0.8]])
        quat, pose = np.tile([1.0, 0, 0, 0], (3, 1)), np.tile(stand_pose(), (3, 1))
        assert success_threshold(make_clip(name, 50.0, root_pos, quat, pose, family=family)) == limit
