"""3D replays inside a page: no server, no network, no script but the page's own.

All replays of a page are one part: robots as body trees with triangles, states of each replay as differences of 16-bit
numbers, deflated. The page's script unpacks them and draws with WebGL 2; where that fails, a picture stays.
"""

import base64
import json
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bumblebee.report.replays.shape import Shape, packed

LARGEST = 3_000_000
"""Bytes of all replays of a page."""
_THINNED = 25.0  # frames a second where all frames would be too many
_STEPS = 65_535


@dataclass(frozen=True)
class Drawn:
    """One robot in the picture."""

    name: str
    """Name in the page; unique in a picture."""
    tint: tuple[float, float, float, float] | None = None
    """RGBA of all its parts; None for its own colours."""


GHOST = (0.25, 0.55, 0.95, 0.3)
"""Colour of a robot that is not there: the reference, or the declared model's simulation (RGBA)."""
FOUND = (0.10, 0.62, 0.35, 0.45)
"""Colour of the corrected model's simulation (RGBA)."""


@dataclass(frozen=True)
class Take:
    """One replay."""

    name: str
    group: str
    """Figure of the page that shows it."""
    states: np.ndarray
    """(F, R * nq): states of the robots side by side."""
    fps: float
    robots: tuple[Drawn, ...]
    shape: Shape
    """States of each of the robots."""
    note: str = ""
    """Line under the picture."""


@dataclass(frozen=True)
class Part:
    """All replays of a page."""

    data: str
    """Text of the page's hidden element."""
    names: tuple[tuple[str, str], ...]
    """(group, name) of the replays that are in it."""
    note: str = ""
    """Note on frames and clips that were left out for size; "" for none."""


def side_by_side(robots: Sequence[np.ndarray]) -> np.ndarray:
    """States (F, R * nq) of a replay from its robots' own, (F, nq) each; shorter ones stand still at their last."""
    longest = max(len(states) for states in robots)
    return np.concatenate([states[np.minimum(np.arange(longest), len(states) - 1)] for states in robots], axis=1)


def part(takes: Sequence[Take], largest: int = LARGEST) -> Part:
    """All replays in at most `largest` bytes: first frames are dropped to 25 a second, then the last replays."""
    kept, note = list(takes), ""
    data = _packed(kept)
    if len(data) > largest:
        kept = [thinned(take) for take in kept]
        note = f"For size, replays show {_THINNED:g} frames a second."
        data = _packed(kept)
    while len(data) > largest and kept:
        kept = kept[: min(len(kept) - 1, int(len(kept) * largest / len(data)))]
        note = f"For size, replays show {_THINNED:g} frames a second, and {len(takes) - len(kept)} are left out."
        data = _packed(kept)
    return Part(data, tuple((take.group, take.name) for take in kept), note)


def thinned(take: Take) -> Take:
    """A replay of at most 25 frames a second."""
    step = max(round(take.fps / _THINNED), 1)
    return replace(take, states=take.states[::step], fps=take.fps / step)


def _packed(takes: Sequence[Take]) -> str:
    shapes: list[dict[str, Any]] = []
    for take in takes:
        if take.shape.data not in shapes:
            shapes.append(take.shape.data)
    document = {"shapes": shapes, "takes": [_take(take, shapes.index(take.shape.data)) for take in takes]}
    return base64.b64encode(zlib.compress(json.dumps(document, separators=(",", ":")).encode(), 9)).decode()


def _take(take: Take, shape: int) -> dict[str, Any]:
    states = _continuous(take)
    low, high = states.min(axis=0), states.max(axis=0)
    step = (high - low) / _STEPS
    moves = step > 0
    whole = np.round((states[:, moves] - low[moves]) / step[moves]).astype(np.int64)
    changes = np.diff(whole, axis=0, prepend=0).astype("<u2")  # wraps, and so does the sum in the page
    return {
        "name": take.name,
        "group": take.group,
        "note": take.note,
        "fps": round(take.fps, 4),
        "frames": len(states),
        "shape": shape,
        "robots": [[robot.name, list(robot.tint) if robot.tint else None] for robot in take.robots],
        "low": [round(float(value), 6) for value in low],
        "step": [float(f"{value:.7g}") for value in step],
        "states": packed(changes.T),
    }


def _continuous(take: Take) -> np.ndarray:
    """States whose quaternions of a free base change sign nowhere, so that they can be interpolated."""
    states = np.array(take.states, dtype=np.float64)
    if not np.isfinite(states).all():
        raise ValueError("a replay's states are finite")
    if take.shape.free:
        for first in range(3, states.shape[1], take.shape.model.nq):
            quat = states[:, first : first + 4]
            flips = np.sum(quat[1:] * quat[:-1], axis=1) < 0
            quat[1:][np.cumsum(flips) % 2 == 1] *= -1
    return states
