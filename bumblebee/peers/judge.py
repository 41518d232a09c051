"""The three rules of a trial, and a fourth for policies that hold no heading."""

from collections.abc import Sequence

import pandas as pd
import torch
from torch import Tensor

from bumblebee.learning.rollout import Tick
from bumblebee.learning.three_rules import ThreeRules
from bumblebee.motion.clip import Clip
from bumblebee.peers.geometry import heading_inverse, turned
from bumblebee.tracking.terminations import fallen


class FourRules(ThreeRules):
    """The judge of `baselines.trial`, which also tells who is lost over the robot's own place and heading."""

    def __init__(self, clips: Sequence[Clip]) -> None:
        super().__init__(clips)
        self._turned = torch.ones(len(clips), dtype=torch.bool)

    def see(self, tick: Tick) -> Tensor:
        """Take in a control step; which robots (N,) bool are kept by any rule and have something left to follow."""
        going = super().see(tick)
        down = fallen(tick.state, tick.ref) | tick.unstable
        self._turned &= ((turned_key_errors(tick).amax(-1) <= self.limit) & ~down) | ~tick.running
        return going | (self._turned & tick.running)

    def table(self, dt: float) -> pd.DataFrame:
        """The rows of `ThreeRules`, and success_heading."""
        return super().table(dt).assign(success_heading=self._turned.numpy())


def turned_key_errors(tick: Tick) -> Tensor:
    """Distances (B, K) [m] of the key bodies from the reference, both seen from their roots and headings.

    As if the reference were moved in the plane until its root stands over the robot's, and turned about the vertical
    through it to the robot's heading.
    """
    state, ref = tick.state, tick.ref
    place = torch.cat((state.root_pos_w[:, :2], ref.root_pos_w[:, 2:]), dim=1)
    robot = turned(heading_inverse(state.root_quat_w), state.key_pos_w - place[:, None])
    wanted = turned(heading_inverse(ref.root_quat_w), ref.key_pos_w - ref.root_pos_w[:, None])
    return (robot - wanted).unflatten(1, (-1, 3)).norm(dim=-1)
