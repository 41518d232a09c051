"""Table `followed.csv`: motions followed against time. Imports nothing of ours, as mjlab's environment reads it too."""

import csv
from collections.abc import Mapping
from pathlib import Path

import numpy as np

CURVE, FOLLOWED = "curve.csv", "followed.csv"
FIRST = 10
"""Iterations in which kernels are compiled and graphs recorded."""


def compiling(seconds: np.ndarray) -> float:
    """How much longer [s] the first iterations took than others; `seconds` (N,) is the time at each one's end."""
    each = np.diff(seconds, prepend=0.0)
    return max(float(each[:FIRST].sum() - FIRST * np.median(each[FIRST:])), 0.0) if len(each) > FIRST else 0.0


def write_followed(
    folder: Path, learner: str, marks: Mapping[float, float], tried: Mapping[float, Mapping[str, tuple[bool, float]]]
) -> None:
    """Write a row for each actor that was kept and each motion.

    Args:
        folder: of the run; its `curve.csv` has `frames` and `seconds` by iteration.
        learner: its name.
        marks: training time at which an actor was kept [s] -> time since the program's start [s].
        tried: the same marks -> motion -> whether it was followed to its end, and the share that was.
    """
    with (folder / CURVE).open() as file:
        rows = list(csv.DictReader(file))
    seconds, frames = (np.array([float(row[name]) for row in rows]) for name in ("seconds", "frames"))
    with (folder / FOLLOWED).open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(("learner", "trained_s", "with_start_s", "frames", "motion", "followed", "share"))
        for mark in sorted(tried):
            at = min(int(np.searchsorted(seconds, mark)), len(seconds) - 1)
            trained = max(seconds[at] - compiling(seconds), 0.0)
            for motion, (followed, share) in tried[mark].items():
                about = learner, round(trained, 1), round(marks[mark], 1), int(frames[at]), motion
                writer.writerow((*about, int(followed), round(share, 3)))
