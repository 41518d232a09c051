"""When an episode is lost: the robot has fallen, or a key body is too far from its reference (paper, section 3.2)."""

import math
from dataclasses import dataclass

from torch import Tensor

from bumblebee.motion.clip import Clip, travels
from bumblebee.sim.engine import RobotState
from bumblebee.sim.rotations import length3, up_axis
from bumblebee.tracking.sampling.library import ReferenceFrame

LOOSE, TIGHT = 0.8, 0.4  # m: how far a key body may be off in motions that travel, and in all others


@dataclass(frozen=True)
class Stop:
    """When a robot is stopped: in training, in trials and in the frozen evaluation when it has fallen."""

    tilt_deg: float = 60.0
    """Angle of the pelvis' up axis from the reference's."""
    drop_m: float = 0.35
    """How far the pelvis is below the reference's."""


FALL = Stop()


def success_threshold(clip: Clip) -> float:
    """Distance of a key body [m] at which a clip counts as failed (paper, appendix A, "Termination")."""
    return LOOSE if travels(clip) else TIGHT


def fallen(state: RobotState, ref: ReferenceFrame) -> Tensor:
    """Robots (B,) bool that lie or topple where the reference does not, or are no longer numbers."""
    here, there = (state.root_quat_w, state.root_pos_w[:, 2]), (ref.root_quat_w, ref.root_pos_w[:, 2])
    return beyond(FALL, *here, *there)


def beyond(stop: Stop, quat: Tensor, height: Tensor, ref_quat: Tensor, ref_height: Tensor) -> Tensor:
    """Robots (B,) bool to be stopped, from the orientations (B, 4) and heights (B,) [m] of pelvis and reference."""
    cosine = (up_axis(quat) * up_axis(ref_quat)).sum(-1)
    return ~((cosine > math.cos(math.radians(stop.tilt_deg))) & (ref_height - height < stop.drop_m))


def key_distance(state: RobotState, ref: ReferenceFrame) -> Tensor:
    """Distance (B,) [m] of the farthest key body from its reference."""
    return length3(state.key_pos_w - ref.key_pos_w).amax(-1)


def threshold_at(progress: float, start: float, end: float, share: float) -> float:
    """The curriculum: from `start` to `end` [m] over the first `share` of the training, never back."""
    part = 1.0 if share <= 0 else min(max(progress / share, 0.0), 1.0)
    return start + (end - start) * part
