"""Stretches of clips as they are drawn, and their failure rates."""

import torch

from bumblebee.tracking.sampling.sampler import ClipShares
from bumblebee.tracking.sampling.stretches import StretchSampler


def sampler(**settings: float) -> StretchSampler:
    """Two clips of 10 and 3 frames in stretches of 4."""
    return StretchSampler(torch.tensor([10, 3]), 4, **settings)


def test_clips_are_cut_into_stretches():
    own = sampler()
    assert own.clip.tolist() == [0, 0, 0, 1]
    assert own.start.tolist() == [0, 4, 8, 0]
    assert own.frames.tolist() == [4, 4, 2, 3]


def test_a_stretch_weighs_its_frames_times_the_failure_of_itself_and_the_next_of_its_clip():
    own = sampler(floor=0.5)
    own.failure[:] = torch.tensor([0.0, 1.0, 0.0, 0.4])
    weight = torch.tensor([4 * 1.0, 4 * 1.0, 2 * 0.5, 3 * 0.9])
    assert torch.allclose(own.probabilities(), weight / weight.sum())


def test_draws_lie_in_the_drawn_stretch_and_follow_the_probabilities():
    own = sampler(floor=0.0, start_share=0.0)
    own.failure[:] = torch.tensor([0.0, 0.0, 1.0, 0.0])
    clip, frame = own.draw(2000, torch.Generator().manual_seed(0))
    assert set(clip.tolist()) == {0}
    assert frame.min() == 4 and frame.max() == 9  # the failing stretch and the one before it
    # by weight 4 * .5 against 2 * 1
    assert abs(float((frame < 8).float().mean()) - 0.5) < 0.05


def test_a_share_of_the_draws_begins_at_the_clips_first_frame():
    clip, frame = sampler(start_share=1.0).draw(50, torch.Generator().manual_seed(0))
    assert frame.eq(0).all() and set(clip.tolist()) == {0, 1}


def test_shares_of_groups_of_clips_hold_whatever_stretch_fails():
    own = StretchSampler(
        torch.tensor([10, 3, 4]), 4, shares=ClipShares(torch.tensor([0, 1, 0]), torch.tensor([1.0, 3.0]))
    )
    for failure in ([0.0, 0.0, 0.0, 0.0, 0.0], [1.0, 1.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0, 0.2]):
        own.failure[:] = torch.tensor(failure)
        assert torch.isclose(own.probabilities()[3], torch.tensor(0.75))


def test_a_lost_world_raises_the_rate_of_its_stretch_alone():
    own = sampler(memory=0.5)
    own.failure.zero_()
    place = torch.tensor([5]), torch.tensor([True]), torch.tensor([True])
    own.follow(torch.tensor([0]), *place)
    assert own.failure.tolist() == [0.0, 0.5, 0.0, 0.0]


def test_a_world_that_leaves_a_stretch_lowers_its_rate():
    own = sampler(memory=0.5)
    own.follow(
        torch.tensor([0, 0]), torch.tensor([3, 5]), torch.zeros(2, dtype=torch.bool), torch.zeros(2, dtype=torch.bool)
    )
    assert own.failure.tolist() == [0.5, 1.0, 1.0, 1.0]


def test_the_end_of_a_clip_counts_as_passed_and_a_time_out_in_the_middle_as_nothing():
    own = sampler(memory=0.5)
    no, yes = torch.tensor([False]), torch.tensor([True])
    own.follow(torch.tensor([0]), torch.tensor([9]), no, yes)
    assert own.failure.tolist() == [1.0, 1.0, 0.5, 1.0]
    own.follow(torch.tensor([0]), torch.tensor([5]), no, yes)
    assert own.failure.tolist() == [1.0, 1.0, 0.5, 1.0]


def test_many_worlds_in_one_step_weigh_as_many_steps():
    own = sampler(memory=0.5)
    lost = torch.tensor([True, False])
    own.follow(torch.tensor([1, 1]), torch.tensor([1, 2]), lost, torch.tensor([True, True]))
    # two robots: half of them lost, with a memory of .5 each
    assert torch.isclose(own.failure[3], torch.tensor(0.25 * 1.0 + 0.75 * 0.5))
