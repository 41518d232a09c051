"""More motions from those that are learned from: at another tempo, and with the arms of another motion.

What a policy has not seen it must have learned from motions that resemble it. Copies keep the legs, the trunk and the
root of a motion, and so its contacts with the floor.
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from benchmarks.motion_pack import Packed
from bumblebee.motion.clip import Clip
from bumblebee.motion.kinematics import lowest, make_clip
from bumblebee.motion.raw import RawMotion
from bumblebee.motion.resample import resample
from bumblebee.robot.facts import joint_names

TEMPO = (0.8, 1.2)
"""Range of the factor on the speed of a copy."""
MARK = "~"
"""Stands in a copy's name before its number."""
ARMS = [i for i, name in enumerate(joint_names()) if "shoulder" in name or "elbow" in name]
"""Columns of the arms' joints."""
_AIR = 0.05  # m: lowest point of the robot beyond which it flies
_FLIGHT = 8  # frames in the air that make a motion one with a flight
_DEEPER = 0.01  # m that other arms may reach lower


def varied(rows: Sequence[Packed], copies: int, seed: int = 0) -> list[Packed]:
    """`copies` of each row: with drawn arms of another row, and at a drawn tempo where it has no flight.

    A flight lasts as long as gravity lets it, so its tempo stays. Arms that would reach more than 1 cm deeper than the
    motion itself are not taken. Only where there is no other row does a motion keep its own.
    """
    generator = np.random.default_rng(seed)
    out = []
    for copy in range(1, copies + 1):
        for own, row in enumerate(rows):
            clip = with_arms(row.clip, rows[another(own, len(rows), generator)].clip, generator.random())
            factor = float(np.exp(generator.uniform(*np.log(TEMPO))))
            clip = clip if flies(clip) else at_tempo(clip, factor)
            out.append(replace(row, clip=replace(clip, name=f"{row.clip.name}{MARK}{copy}")))
    return out


def another(own: int, count: int, generator: np.random.Generator) -> int:
    """A drawn index below `count`; the one after `own` (or the first) where `own` itself is drawn."""
    drawn = int(generator.integers(count))
    return (own + 1) % count if drawn == own else drawn


def shares(rows: Sequence[Packed], embedded: float = 1.0) -> Tensor:
    """Factors (N,) on how often motions are drawn for their length: all copies together weigh what the originals do.

    Args:
        rows: originals and copies of `varied`.
        embedded: factor for the embedded motions.
    """
    copies = [MARK in row.clip.name for row in rows]
    each = (len(rows) - sum(copies)) / max(sum(copies), 1)
    groups = [embedded if row.group == "embedded" else 1.0 for row in rows]
    return torch.tensor([group * (each if copy else 1.0) for group, copy in zip(groups, copies, strict=True)])


def with_arms(clip: Clip, other: Clip, begin: float) -> Clip:
    """The clip with the arms of `other`, which begin at a share of what `other` is longer, and stop at its end.

    The clip itself if they would reach lower than it does by more than 1 cm in any frame.
    """
    first = int(begin * max(other.frames - clip.frames, 0))
    frames = np.minimum(first + np.arange(clip.frames), other.frames - 1)
    joints = clip.joint_pos.copy()
    joints[:, ARMS] = other.joint_pos[frames][:, ARMS]
    if (_lowest(clip, joints) < _lowest(clip, clip.joint_pos) - _DEEPER).any():
        return clip
    return _remade(clip, clip.root_pos, clip.root_quat, joints)


def at_tempo(clip: Clip, factor: float) -> Clip:
    """The clip `factor` times as fast, at its own rate; its last frame falls on the last sample within the motion."""
    raw = RawMotion(clip.name, clip.fps * factor, clip.root_pos, clip.root_quat, clip.joint_pos, Path(clip.name))
    made = resample(raw, clip.fps)
    return _remade(clip, made.root_pos, made.root_quat, made.joint_pos)


def flies(clip: Clip) -> bool:
    """Whether the robot touches nothing for 8 frames or more in all."""
    return int((_lowest(clip, clip.joint_pos) > _AIR).sum()) >= _FLIGHT


def _lowest(clip: Clip, joints: np.ndarray) -> np.ndarray:
    """Height of the robot's lowest point (T,) [m] with these joints (T, 23) [rad]."""
    return lowest(clip.root_pos, clip.root_quat, joints)


def _remade(clip: Clip, root_pos: np.ndarray, root_quat: np.ndarray, joint_pos: np.ndarray) -> Clip:
    """A clip of these arrays that is otherwise like `clip`."""
    about = {"family": clip.family, "split": clip.split, "licence": clip.licence, "source": clip.source}
    return make_clip(clip.name, clip.fps, root_pos, root_quat, joint_pos, **about)
