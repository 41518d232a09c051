"""The judge of a trial by three rules: in the world, over the robot's own place, and upright.

For every policy, whatever ended its episodes in training: lost where a key body is farther from its reference than the
family's threshold, or the robot has fallen.
"""

from collections.abc import Sequence

import pandas as pd
import torch
from torch import Tensor

from bumblebee.learning.rollout import Judge, Tick
from bumblebee.motion.clip import Clip
from bumblebee.sim.engine import RobotState
from bumblebee.sim.rotations import rotate_inverse
from bumblebee.tracking.sampling.library import ReferenceFrame, over_robot
from bumblebee.tracking.terminations import fallen

UPRIGHT_HEIGHT, UPRIGHT_TILT = 0.25, 0.8
"""The rule of BeyondMimic and what follows it: lost where the pelvis is so many metres too high or low, or gravity's
part along the base's z is off by so much."""


class ThreeRules(Judge):
    """The judge of a trial, which also tells who is lost over the robot's own place, and by `upright`."""

    def __init__(self, clips: Sequence[Clip]) -> None:
        super().__init__(clips)
        self._clips = clips
        self._local, self._upright = torch.ones(2, len(clips), dtype=torch.bool).unbind()
        self._local_error = torch.zeros(len(clips))

    def see(self, tick: Tick) -> Tensor:
        """Take in a control step; which robots (N,) bool are kept by any rule and have something left to follow."""
        going = super().see(tick)
        local = key_errors(tick.state, tick.ref)[1]
        down = fallen(tick.state, tick.ref) | tick.unstable
        self._local &= ((local.amax(-1) <= self.limit) & ~down) | ~tick.running
        self._upright &= (upright(tick.state, tick.ref) & ~tick.unstable) | ~tick.running
        self._local_error += torch.where(going, local.mean(-1), 0.0)
        return (self.kept | self._local | self._upright) & tick.running

    def table(self, dt: float) -> pd.DataFrame:
        """The rows of `follow`; `dt` is a control step [s]."""
        about = [(clip.name, clip.family, clip.split, clip.duration) for clip in self._clips]
        table = pd.DataFrame(about, columns=["name", "family", "split", "seconds"])
        table["success"], table["success_local"] = self.kept.numpy(), self._local.numpy()
        table["success_upright"] = self._upright.numpy()
        table["lost_at"] = torch.where(self.kept, torch.nan, self.frames * dt).numpy()
        table["mpjpe_rad"] = self.joint_error.numpy()
        table["mpkpe_mm"] = (1000 * self.key_error).numpy()
        table["mpkpe_local_mm"] = (1000 * self._local_error / self.frames.clamp(min=1)).numpy()
        return table


def upright(state: RobotState, ref: ReferenceFrame) -> Tensor:
    """Robots (B,) bool whose pelvis is about as high and as tilted as the reference's."""
    high = (state.root_pos_w[:, 2] - ref.root_pos_w[:, 2]).abs() <= UPRIGHT_HEIGHT
    down = torch.tensor([0.0, 0.0, -1.0]).expand(len(high), 3)
    tilt = rotate_inverse(state.root_quat_w, down)[:, 2] - rotate_inverse(ref.root_quat_w, down)[:, 2]
    return high & (tilt.abs() <= UPRIGHT_TILT)


def key_errors(state: RobotState, ref: ReferenceFrame) -> tuple[Tensor, Tensor]:
    """Distances (B, K) [m] of the key bodies from the reference: in the world, and with its root over the robot's."""
    world = (state.key_pos_w - ref.key_pos_w).norm(dim=-1)
    return world, (state.key_pos_w - over_robot(ref, state.root_pos_w).key_pos_w).norm(dim=-1)
