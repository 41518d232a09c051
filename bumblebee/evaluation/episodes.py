"""An episode's metrics from what was measured, the same way on the simulator, the stand-in and a real robot."""

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.evaluation.metrics import EpisodeMetrics, episode_metrics
from bumblebee.measured.rollout import Rollout
from bumblebee.motion.clip import Clip
from bumblebee.motion.kinematics import forward_key_positions


def rollout_metrics(rollout: Rollout, clip: Clip, threshold: float) -> EpisodeMetrics:
    """Metrics of a measured rollout of `clip`.

    On a robot the truth is not to be had: joint angles are the encoders' (an encoder offset is not seen as an error),
    key bodies are forward kinematics of encoders, orientation and `base_pos`, sensor noise included.
    """
    if rollout.base_pos is None or rollout.base_quat is None:
        raise BadInput(
            f"{rollout.rollout_id}: base_pos, base_quat", "both columns", "one that is absent", "MPKPE is in the world."
        )
    if abs(rollout.control_hz - clip.fps) > 1e-6:
        raise BadInput(f"{rollout.rollout_id}: control_hz", f"the clip's {clip.fps:g} Hz", f"{rollout.control_hz:g} Hz")
    length = min(rollout.frames, clip.frames)
    base_pos, base_quat, joint_pos = (
        values[:length] for values in (rollout.base_pos, rollout.base_quat, rollout.joint_pos)
    )
    keys = forward_key_positions(base_pos, base_quat, joint_pos)
    return episode_metrics(joint_pos, keys, np.asarray(clip.joint_pos), np.asarray(clip.key_pos), threshold)
