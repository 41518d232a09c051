"""The three rules of a trial, and a fourth for policies that hold no heading."""

from collections.abc import Sequence

import pandas as pd
import torch
from torch import Tensor

from bumblebee.baselines.trial import ThreeRules
from bumblebee.learning.rollout import Tick
from bumblebee.motion.clip import Clip
from bumblebee.sim.rotations import rotate
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
    """Distances (B, K) [m] of the key bodies from the reference whose root is moved over the robot's and turned.

    It is moved in the plane and turned about the vertical through it, until it has the robot's heading.
    """
    state, ref = tick.state, tick.ref
    half = 0.5 * (heading(state.root_quat_w) - heading(ref.root_quat_w))
    none = torch.zeros_like(half)
    turn = torch.stack((half.cos(), none, none, half.sin()), dim=-1)
    place = torch.cat((state.root_pos_w[:, :2], ref.root_pos_w[:, 2:]), dim=1)
    offset = ref.key_pos_w - ref.root_pos_w[:, None]
    wanted = place[:, None] + rotate(turn[:, None].expand(-1, offset.shape[1], -1), offset)
    return (state.key_pos_w - wanted).norm(dim=-1)


def heading(quat: Tensor) -> Tensor:
    """Yaw (B,) [rad] of orientations (B, 4)."""
    w, x, y, z = quat.unbind(-1)
    return torch.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
