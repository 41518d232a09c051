"""Motion features of the text-motion autoencoder (paper, section "AE Clustering").

M_full = {p_t, r_t, rdot_t, c_t, v_feet_t}; the reconstruction target M drops redundant positions and keeps those of
head, pelvis, hands and feet. docs/decisions/clustering-features.md says which frames are used and why.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil

import numpy as np

from bumblebee import quaternions
from bumblebee.motion.clip import Clip
from bumblebee.motion.contacts import foot_contacts
from bumblebee.motion.kinematics import forward_bodies
from bumblebee.robot import facts
from bumblebee.robot.facts import BODY_OF, FEET, KEY_BODIES, PELVIS

HEAD = "head"
_HEAD_BODY, _HEAD_PLACE = facts.HEAD
POSITIONS = (*KEY_BODIES, HEAD)
KEPT_POSITIONS = (PELVIS, HEAD, BODY_OF["left_hand"], BODY_OF["right_hand"], *FEET)

_FEET = [KEY_BODIES.index(foot) for foot in FEET]

COLUMNS = (
    *(f"p.{body}.{axis}" for body in POSITIONS for axis in "xyz"),
    *(f"r.{axis}" for axis in "xyz"),
    *(f"rdot.{axis}" for axis in "xyz"),
    "c.left",
    "c.right",
    *(f"v.{foot}.{axis}" for foot in FEET for axis in "xyz"),
)
TARGET_COLUMNS = tuple(
    i for i, name in enumerate(COLUMNS) if not name.startswith("p.") or name.split(".")[1] in KEPT_POSITIONS
)
# Smallest standard deviation that a column is divided by, so that a still body does not turn noise into signal.
_FLOOR = {"p": 0.02, "r": 0.02, "rdot": 0.05, "c": 0.1, "v": 0.05}


@dataclass(frozen=True)
class Normaliser:
    """Mean and deviation of every column over the training windows, each (D,)."""

    mean: np.ndarray
    std: np.ndarray


def motion_windows(clip: Clip, fps: float, seconds: float, contacts: np.ndarray | None = None) -> list[np.ndarray]:
    """The clip at `fps`, cut into equal windows of at most `seconds`, each (T, D) in the order of `COLUMNS`, float32.

    Units are m, m/s and 0/1. Each window stands in its own start frame: shifting or turning (about the vertical)
    the whole clip changes nothing, lifting it does. `contacts` (frames, 2) are the clip's, where they are known.
    """
    velocity = np.gradient(clip.root_pos, 1.0 / clip.fps, axis=0)
    feet_velocity = np.gradient(clip.key_pos[:, _FEET], 1.0 / clip.fps, axis=0)
    contacts = foot_contacts(clip) if contacts is None else contacts
    parts = window_frames(clip, fps, seconds)
    return [_window(clip, velocity, feet_velocity, contacts, part) for part in parts]


def window_frames(clip: Clip, fps: float, seconds: float) -> list[np.ndarray]:
    """Which frames of the clip each of its windows has, (T,) each."""
    count = max(1, round(clip.frames / clip.fps * fps))
    frames = np.minimum(np.round(np.arange(count) * clip.fps / fps).astype(int), clip.frames - 1)
    return np.array_split(frames, ceil(count / max(1, round(fps * seconds))))


def window_times(clip: Clip, fps: float, seconds: float) -> list[tuple[float, float]]:
    """From when to when each window lasts, seconds from the clip's first frame; one ends where the next begins."""
    starts = [float(frames[0] / clip.fps) for frames in window_frames(clip, fps, seconds)]
    return list(zip(starts, [*starts[1:], clip.duration], strict=True))


def positions(clip: Clip, frames: np.ndarray) -> np.ndarray:
    """Positions of `POSITIONS` in some frames (T,) of the clip, (T, 15, 3) [m, world].

    The head is a point of a body: the G1 has no head link, and its point is the centre of its sphere `head_collision`.
    """
    pos, quat = forward_bodies(clip.root_pos[frames], clip.root_quat[frames], clip.joint_pos[frames])[_HEAD_BODY]
    head = pos + quaternions.rotate(quat, np.array(_HEAD_PLACE))
    return np.concatenate([clip.key_pos[frames], head[:, None]], 1)


def fit_normaliser(windows: Sequence[np.ndarray]) -> Normaliser:
    """Statistics of the training windows; deviations have a floor by the kind of column."""
    rows = np.concatenate(windows)
    floor = np.array([_FLOOR[name.split(".")[0]] for name in COLUMNS])
    return Normaliser(rows.mean(0), np.maximum(rows.std(0), floor))


def pad(windows: Sequence[np.ndarray], length: int | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Stack windows of unequal length: values (B, T, D) with zeros behind the end, mask (B, T) true where real."""
    longest = max(len(window) for window in windows) if length is None else length
    values = np.zeros((len(windows), longest, windows[0].shape[1]), np.float32)
    mask = np.zeros((len(windows), longest), bool)
    for row, window in enumerate(windows):
        values[row, : len(window)] = window
        mask[row, : len(window)] = True
    return values, mask


def heading(quat: np.ndarray) -> np.ndarray:
    """Angle of the body's x axis about the vertical, (...,) [rad], from wxyz (..., 4)."""
    w, x, y, z = np.moveaxis(quat, -1, 0)
    return np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


def _window(
    clip: Clip, velocity: np.ndarray, feet_velocity: np.ndarray, contacts: np.ndarray, frames: np.ndarray
) -> np.ndarray:
    root, key = clip.root_pos[frames], positions(clip, frames)
    yaw = heading(clip.root_quat[frames])
    ground = root * (1.0, 1.0, 0.0)  # heights stay those above the floor, they tell a squat from a stand
    seen = _unyaw(key - ground[:, None], yaw)
    translation = _unyaw(root - ground[:1], np.full(len(frames), yaw[0]))
    feet = _unyaw(feet_velocity[frames], yaw)
    parts = (seen, translation, _unyaw(velocity[frames], yaw), contacts[frames], feet)
    return np.concatenate([part.reshape(len(frames), -1) for part in parts], 1).astype(np.float32)


def _unyaw(vectors: np.ndarray, yaw: np.ndarray) -> np.ndarray:
    """Vectors (T, ..., 3) seen from axes turned by `yaw` (T,) about the vertical."""
    angle = yaw.reshape(-1, *[1] * (vectors.ndim - 2))
    cos, sin = np.cos(angle), np.sin(angle)
    x, y, z = np.moveaxis(vectors, -1, 0)
    return np.stack([cos * x + sin * y, cos * y - sin * x, z], -1)
