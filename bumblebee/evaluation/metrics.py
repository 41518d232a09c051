"""Success rate, MPJPE and MPKPE of one episode (paper, appendix A, "Metrics").

Where the paper is inconsistent, this is what is computed:

- MPJPE is printed with J_i in R^3 yet in radians. Here a joint is one angle: the mean over frames and joints of
  |q - q_ref| [rad]; no joint is wrapped, since none turns further than half a circle from its reference.
- The printed sums run over joints or keypoints of one frame; here the mean is also over the frames of the episode.
- "Follow with reasonable accuracy" is the termination of the same appendix: the largest distance of any key body
  from its reference in the world frame stays within 0.8 m (walking: the root travels) or 0.4 m (all else).

Frames are matched by index (tick k against frame k) in the world frame; nothing is aligned in space or time.
"""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class EpisodeMetrics:
    """Metrics of one episode."""

    success: bool
    """The clip was followed to its end: no fall, no key body beyond the threshold."""
    mpjpe_rad: float
    """Mean |q - q_ref| over joints and over the frames before termination [rad]."""
    mpkpe_mm: float
    """Mean distance of the key bodies from the reference, world frame, over the same frames [mm]."""
    frames: int
    """Frames before termination, those that the two errors average over; at least one."""
    end_reason: str
    """"end", "keypoint" (threshold exceeded) or "fall"."""


def key_errors(key_pos_w: np.ndarray, reference_w: np.ndarray) -> np.ndarray:
    """Distance of each key body from its reference; both (T, K, 3) [m] world -> (T, K) [m]."""
    return np.linalg.norm(np.asarray(key_pos_w) - np.asarray(reference_w), axis=-1)


def episode_metrics(
    joint_pos: np.ndarray,
    key_pos_w: np.ndarray,
    reference_joint_pos: np.ndarray,
    reference_key_pos_w: np.ndarray,
    threshold: float,
) -> EpisodeMetrics:
    """Metrics of one episode against its clip.

    Args:
        joint_pos: (t, J) [rad], t <= T; an episode that ended before the clip did is a fall.
        key_pos_w: (t, K, 3) [m] world.
        reference_joint_pos: (T, J) [rad], the clip.
        reference_key_pos_w: (T, K, 3) [m] world, the clip.
        threshold: largest distance of any key body from its reference [m].
    """
    length, whole = len(joint_pos), len(reference_joint_pos)
    distance = key_errors(key_pos_w, reference_key_pos_w[:length])
    # A frame that is not finite is beyond any threshold: NaN must never pass as success.
    beyond = np.flatnonzero(~(distance.max(axis=1) <= threshold))
    frames = max(int(beyond[0]) if len(beyond) else length, 1)
    reason = "keypoint" if len(beyond) else ("fall" if length < whole else "end")
    joint_error = np.abs(joint_pos[:frames] - reference_joint_pos[:frames])
    return EpisodeMetrics(
        success=reason == "end",
        mpjpe_rad=float(joint_error.mean()),
        mpkpe_mm=float(1000 * distance[:frames].mean()),
        frames=frames,
        end_reason=reason,
    )
