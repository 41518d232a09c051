"""The unit and the up axis of a skeleton: read off the body, or asked for where the body does not tell.

A person's legs have one length whatever the file: hip to knee to ankle from `LEGS[0]` to `LEGS[1]` (men and women of
1.40 to 2.10 m have 0.65 to 1.1 m). A unit that puts them there is the file's unit where it is the only one.
"""

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.motion.human.motion import LANDMARKS
from bumblebee.motion.reading.remedy import say

UNITS = {"m": 1.0, "dm": 0.1, "cm": 0.01, "mm": 0.001, "inch": 0.0254, "cmu": 0.0254 / 0.45}
"""Metres in a unit; `cmu` is that of CMU's files and their conversion by cgspeed (1 / 0.45 inch)."""
LEGS = (0.65, 1.1)
_POSSIBLE = (0.2, 1.5)  # legs of a child, of a stylised figure [m]: beyond, a stated unit is wrong
_UPRIGHT = 0.7  # of the leg that stands, the share along an axis that is up: within 45 degrees

_INDEX = {name: i for i, name in enumerate(LANDMARKS)}


def leg_length(positions: np.ndarray) -> float:
    """Hip to knee to ankle, the mean of both sides, the median over the frames; of (T, 18, 3)."""
    both = []
    for side in ("left", "right"):
        chain = positions[:, [_INDEX[f"{side}_{joint}"] for joint in ("hip", "knee", "ankle")]]
        both.append(np.linalg.norm(np.diff(chain, axis=1), axis=2).sum(axis=1))
    return float(np.median(np.mean(both, axis=0)))


def find_unit(where: object, legs: float, stated: str) -> tuple[float, tuple[str, ...]]:
    """Metres in the file's unit, and a note where it was found and not stated.

    Args:
        where: the file.
        legs: length of a leg in the file's unit.
        stated: the unit as the user says it; "" if they do not.

    Raises:
        BadInput: no unit fits, or the stated one cannot be.
    """
    possible = [name for name, metres in UNITS.items() if _POSSIBLE[0] <= legs * metres <= _POSSIBLE[1]]
    do = say(*({"unit": name} for name in possible)) if possible else ""
    if stated:
        if stated not in possible:
            came = f"legs of {legs * UNITS[stated]:.4g} m with the unit {stated}"
            raise BadInput(where, f"legs of {_POSSIBLE[0]} to {_POSSIBLE[1]} m", came, do)
        return UNITS[stated], ()
    fitting = [name for name, metres in UNITS.items() if LEGS[0] <= legs * metres <= LEGS[1]]
    if len(fitting) != 1:
        came = f"legs of {legs:.4g} units, which {' and '.join(fitting) or 'none'} would explain"
        wanted = f"a unit (of {', '.join(UNITS)}) with legs of {LEGS[0]} to {LEGS[1]} m"
        raise BadInput(where, wanted, came, do)
    return UNITS[fitting[0]], (f"unit {fitting[0]}, by legs of {legs:.4g} units = {legs * UNITS[fitting[0]]:.3f} m",)


AXES = ("x", "y", "z", "-x", "-y", "-z")
_UP = ("y", "z")
"""The axes that files have for up; a leg that stands along another one is a person who lies, or other axes."""


def upright_axis(positions: np.ndarray) -> str:
    """The one of `AXES` along which the leg that stands points up, from ankle to hip; "" if it is none.

    The leg that stands is the one whose ankle moves least, whatever the trunk does. Of 210 motions of people its median
    share along the up axis was .79 at least; that of the head above the feet .70, where the trunk is held level.

    Args:
        positions: (T, 18, 3), of a moving person or of a skeleton's own pose alone.
    """
    ankles = positions[:, [_INDEX["left_ankle"], _INDEX["right_ankle"]]]
    rise = positions[:, [_INDEX["left_hip"], _INDEX["right_hip"]]] - ankles
    moved = np.linalg.norm(np.diff(ankles, axis=0, append=ankles[-1:]), axis=2)
    leg = np.take_along_axis(rise, moved.argmin(axis=1)[:, None, None], axis=1)[:, 0]
    middle = np.median(leg / np.maximum(np.linalg.norm(leg, axis=1, keepdims=True), 1e-9), axis=0)
    return next((name for name, share in zip(AXES, (*middle, *-middle), strict=True) if share > _UPRIGHT), "")


def standing_axis(pose: np.ndarray) -> str:
    """`upright_axis` of a skeleton's own pose (18, 3); "" where the hips are not between head and feet.

    Some files lay every bone along one axis there: that is no person, and says nothing of the axes.
    """
    axis = upright_axis(pose[None])
    place, sign = "xyz".find(axis[-1:] or "-"), -1 if axis.startswith("-") else 1
    trunk = pose[_INDEX["head"]] - pose[_INDEX["pelvis"]]
    return axis if axis and sign * trunk[place] > 0 else ""


def find_up(where: object, moving: str, resting: str, stated: str) -> tuple[str, tuple[str, ...]]:
    """The up axis, and a note where it was found and not stated.

    Args:
        where: the file.
        moving: what the motion shows (`upright_axis`).
        resting: what the skeleton's own pose shows.
        stated: the axis as the user says it; "" if they do not.

    Raises:
        BadInput: the body tells neither or both: a person who lies, or a rig that stands another way.
    """
    if stated:
        return stated, ()
    told = {axis for axis in (moving, resting) if axis}
    if len(told) != 1 or not told <= set(_UP):
        both = f"a person along {moving} by the motion, along {resting} by the skeleton's own pose"
        came = both if len(told) > 1 else f"a person along {moving or resting or 'no axis'}"
        raise BadInput(where, "a person who stands along y or z, which is up then", came, ask_up(*told))
    (axis,) = told
    by = "the motion" if moving else "the skeleton's own pose alone"
    return axis, (f"{axis} is up, by {by}",)


def ask_up(*axes: str) -> str:
    """How to say which axis is up: one of those that the body shows, or y or z for a person who lies."""
    return say(*({"up": axis} for axis in dict.fromkeys((*sorted(axes), *_UP))))


def z_up(positions: np.ndarray, up: str) -> np.ndarray:
    """Positions turned so that z is up; a turn, no mirror: left stays left."""
    x, y, z = np.moveaxis(positions, -1, 0)
    turned = {"z": (x, y, z), "-z": (x, -y, -z), "y": (x, -z, y), "-y": (x, z, -y), "x": (-z, y, x), "-x": (z, y, -x)}
    return np.stack(turned[up], axis=-1)


def toes_ahead(positions: np.ndarray) -> float:
    """Above 0 where the toes of a body (T, 18, 3) point ahead in most of the frames, below 0 where they point back.

    Ahead is across the way from the right hip to the left one and up the shank, in right-handed axes, however the
    person stands or lies.
    """
    across = positions[:, _INDEX["left_hip"]] - positions[:, _INDEX["right_hip"]]
    forward = np.zeros(len(positions))
    for side in ("left", "right"):
        knee, ankle, toe = (positions[:, _INDEX[f"{side}_{joint}"]] for joint in ("knee", "ankle", "toe"))
        forward += np.einsum("ti,ti->t", np.cross(across, knee - ankle), toe - ankle)
    return float(np.median(forward))


def knees_ahead(positions: np.ndarray) -> float:
    """Likewise above 0 where the knees of a body (T, 18, 3) bend ahead, below 0 where they bend back."""
    across = positions[:, _INDEX["left_hip"]] - positions[:, _INDEX["right_hip"]]
    forward = np.zeros(len(positions))
    for side in ("left", "right"):
        hip, knee, ankle = (positions[:, _INDEX[f"{side}_{joint}"]] for joint in ("hip", "knee", "ankle"))
        forward += np.einsum("ti,ti->t", np.cross(across, hip - ankle), knee - (hip + ankle) / 2)
    return float(np.median(forward))


def require_right_handed(where: object, positions: np.ndarray) -> None:
    """Refuse a body whose feet point backwards: left and right are exchanged, or the axes are left-handed.

    Raises:
        BadInput: in most frames the toes are behind the ankles.
    """
    if toes_ahead(positions) < 0:
        came = "toes that point backwards: left and right exchanged, or left-handed axes"
        raise BadInput(where, "right-handed axes, and left joints on the left", came, "Export the file again.")
