"""Another frame rate for a motion: cubic splines for positions and joints, slerp for the root's rotation."""

from dataclasses import replace

import numpy as np
from scipy.interpolate import CubicSpline

from bumblebee import quaternions
from bumblebee.motion.raw import RawMotion


def resample(raw: RawMotion, fps: float) -> RawMotion:
    """Motion at `fps`; the first frame stays, the last falls on the last sample within the motion.

    Where a new sample coincides with an old one it keeps its value, so resampling to the present rate changes nothing.
    """
    frames = len(raw.root_pos)
    if frames < 2 or np.isclose(fps, raw.fps):
        return replace(raw, fps=float(fps), root_quat=quaternions.continuous(quaternions.normalised(raw.root_quat)))
    count = int(np.floor((frames - 1) / raw.fps * fps + 1e-6)) + 1
    at = np.minimum(np.arange(count) * (raw.fps / fps), frames - 1)
    return replace(
        raw,
        fps=float(fps),
        root_pos=CubicSpline(np.arange(frames), raw.root_pos)(at),
        root_quat=_slerp(quaternions.normalised(raw.root_quat), at),
        joint_pos=CubicSpline(np.arange(frames), raw.joint_pos)(at),
    )


def _slerp(quat: np.ndarray, at: np.ndarray) -> np.ndarray:
    before = np.minimum(at.astype(int), len(quat) - 2)
    return quaternions.continuous(quaternions.slerp(quat[before], quat[before + 1], at - before))
