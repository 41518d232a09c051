"""When an episode is lost: the robot has fallen, or a key body is too far from its reference (paper, section 3.2)."""

from torch import Tensor

from bumblebee.motion.clip import Clip, travels
from bumblebee.sim.engine import RobotState
from bumblebee.sim.rotations import angle_between, length3
from bumblebee.tracking.library import ReferenceFrame

FALL_HEIGHT = 0.35  # m: the pelvis is this much lower than its reference
FALL_ANGLE = 1.2  # rad: or tilted this far away from it


def success_threshold(clip: Clip, walking: float = 0.8, other: float = 0.4) -> float:
    """Distance of a key body [m] at which a clip counts as failed: `walking` where it travels (paper, metrics)."""
    return walking if travels(clip) else other


def fallen(state: RobotState, ref: ReferenceFrame) -> Tensor:
    """Robots (B,) bool that lie or topple where the reference does not."""
    return lying(state, ref, angle_between(state.root_quat_w, ref.root_quat_w))


def lying(state: RobotState, ref: ReferenceFrame, angle: Tensor) -> Tensor:
    """`fallen`, from the `angle` (B,) [rad] between the roots."""
    low = state.root_pos_w[:, 2] < ref.root_pos_w[:, 2] - FALL_HEIGHT
    return low | (angle > FALL_ANGLE)


def key_distance(state: RobotState, ref: ReferenceFrame) -> Tensor:
    """Distance (B,) [m] of the farthest key body from its reference."""
    return length3(state.key_pos_w - ref.key_pos_w).amax(-1)


def threshold_at(progress: float, start: float, end: float, share: float) -> float:
    """The curriculum: from `start` to `end` [m] over the first `share` of the training, never back."""
    part = 1.0 if share <= 0 else min(max(progress / share, 0.0), 1.0)
    return start + (end - start) * part
