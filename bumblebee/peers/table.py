"""Trials by several rules as a table: shares and errors with 95 % intervals over motions, and paired differences."""

from collections.abc import Iterator, Mapping

import numpy as np
import pandas as pd

from bumblebee.evaluation.intervals import bootstrap_mean, mean_by_motion, motion_means, sign_flip_test, success_rate
from bumblebee.motion.pieces import motion_of

RULES = {
    "success": "key bodies",
    "success_local": "own place",
    "success_heading": "own place and heading",
    "success_upright": "pelvis",
}
"""Columns of a trial that are shares -> their heads."""
_ERRORS = {"mpjpe_rad": ("MPJPE [rad]", 3), "mpkpe_local_mm": ("MPKPE, own place [mm]", 0)}


def table(tried: Mapping[str, pd.DataFrame]) -> Iterator[str]:
    """Lines of a Markdown table, a row for each of the trials.

    All pieces of a motion count as one motion in the intervals; errors are those until the loss by the first rule.

    Args:
        tried: what was tried -> its trials, as `try_peer` gives them.
    """
    heads = ["policy", "n", *RULES.values(), *(head for head, _ in _ERRORS.values())]
    yield "| " + " | ".join(heads) + " |"
    yield "|" + "---|" * len(heads)
    for name, rows in tried.items():
        motions = _motions(rows)
        cells = [name, str(len(rows))]
        for column in RULES:
            rate = success_rate(rows[column].to_numpy(dtype=bool), motions)
            cells.append(_cell(rate.value, rate.low, rate.high, 2))
        for column, (_, digits) in _ERRORS.items():
            mean = mean_by_motion(rows[column].to_numpy(dtype=float), motions)
            cells.append(_cell(mean.value, mean.low, mean.high, digits))
        yield "| " + " | ".join(cells) + " |"


def differences(first: pd.DataFrame, second: pd.DataFrame) -> Iterator[str]:
    """A line for each rule: the first trials' share less the second's on the same motions, with interval and p.

    Args:
        first: trials as `try_peer` gives them.
        second: those of another policy on the same motions in the same order.
    """
    for column, head in RULES.items():
        gain = first[column].to_numpy(dtype=float) - second[column].to_numpy(dtype=float)
        means = motion_means(gain, _motions(first))
        low, high = bootstrap_mean(means)
        yield f"{head}: {means.mean():+.2f} [{low:+.2f}, {high:+.2f}], p = {sign_flip_test(means):.2g}"


def _motions(rows: pd.DataFrame) -> np.ndarray:
    return rows["name"].map(motion_of).to_numpy()


def _cell(value: float, low: float, high: float, digits: int) -> str:
    span = f" [{low:.{digits}f}, {high:.{digits}f}]" if np.isfinite([low, high]).all() else ""
    return f"{value:.{digits}f}{span}"
