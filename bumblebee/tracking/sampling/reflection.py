"""Motions with left and right exchanged, beside those that they are of: what a learner's worlds play."""

from collections.abc import Sequence

import numpy as np
import torch

from bumblebee.motion.clip import Clip
from bumblebee.motion.kinematics import make_clip
from bumblebee.tracking.mirror import joint_reflection
from bumblebee.tracking.sampling.sampler import ClipShares

MARK = " reflected"
"""Behind the name of a motion in a reflection's name."""


def reflected(clip: Clip) -> Clip:
    """The clip in a mirror, in the plane of x and z."""
    order, sign = joint_reflection()
    joints = clip.joint_pos[:, order] * np.array(sign)
    about = {"family": clip.family, "split": clip.split, "licence": clip.licence, "source": clip.source}
    place, turn = clip.root_pos * [1, -1, 1], clip.root_quat * [1, -1, 1, -1]
    return make_clip(clip.name + MARK, clip.fps, place, turn, joints, **about)


def with_reflections(clips: Sequence[Clip], share: ClipShares | None) -> tuple[list[Clip], ClipShares | None]:
    """The clips and behind them their reflections; each group keeps its share of the draws."""
    twice = torch.arange(len(clips)).repeat(2)
    return [*clips, *map(reflected, clips)], None if share is None else share.of(twice)
