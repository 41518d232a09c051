"""Reflected motions, and how often they are drawn."""

import numpy as np
import torch

from bumblebee.motion.embedded import EmbeddedConfig, make_library
from bumblebee.robot.facts import KEY_BODIES
from bumblebee.robot.mirror import other_side
from bumblebee.tracking.sampling.reflection import MARK, reflected, with_reflections
from bumblebee.tracking.sampling.sampler import ClipShares

CLIPS = make_library(EmbeddedConfig(limit=2))


def test_a_reflected_motion_has_the_other_sides_key_bodies_and_reflected_twice_is_itself() -> None:
    clip = CLIPS[0]
    made = reflected(clip)
    order = [KEY_BODIES.index(other_side(name)) for name in KEY_BODIES]
    assert np.allclose(made.key_pos, clip.key_pos[:, order] * [1, -1, 1], atol=2e-3)  # the robot is symmetric to 2 mm
    assert not np.allclose(made.joint_pos, clip.joint_pos, atol=0.1)
    assert (made.name, made.split, made.licence) == (clip.name + MARK, clip.split, clip.licence)
    again = reflected(made)
    assert np.allclose(again.joint_pos, clip.joint_pos) and np.allclose(again.root_quat, clip.root_quat, atol=1e-6)


def test_a_reflection_is_of_its_motions_group_and_groups_keep_their_shares() -> None:
    share = ClipShares(torch.tensor([0, 1]), torch.tensor([3.0, 1.0]))
    clips, shares = with_reflections(CLIPS, share)
    assert [clip.name for clip in clips] == [name + mark for mark in ("", MARK) for name in (c.name for c in CLIPS)]
    assert shares is not None and shares.group.tolist() == [0, 1, 0, 1] and shares.share.tolist() == [3.0, 1.0]
    assert with_reflections(CLIPS, None)[1] is None
