"""Worst case of a rule in a motion, and how it is looked for."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Worst:
    """A rule's finding: the worst value, its limit and unit, the frame, and a sentence for people."""

    value: float
    limit: float
    unit: str
    frame: int
    explanation: str


def steps(values: np.ndarray, fps: float) -> np.ndarray:
    """Change from each frame to the next, per second, (T - 1, ...); zero for a single frame."""
    if len(values) < 2:
        return np.zeros_like(values, dtype=np.float64)
    return np.diff(values.astype(np.float64), axis=0) * fps


def largest(values: np.ndarray) -> tuple[int, int]:
    """Frame and column of the largest of (T, N)."""
    frame, column = np.unravel_index(int(np.argmax(values)), values.shape)
    return int(frame), int(column)


def longest_run(flags: np.ndarray) -> tuple[int, int]:
    """Start and length of the longest run of True; (0, 0) if there is none."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(int)))
    starts, ends = edges[::2], edges[1::2]
    if not len(starts):
        return 0, 0
    best = int(np.argmax(ends - starts))
    return int(starts[best]), int(ends[best] - starts[best])
