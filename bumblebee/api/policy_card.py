"""Card of a policy that `train` wrote: facts for programs (card.json) and for people (README.md)."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from bumblebee.evaluation.intervals import mean_by_motion, success_rate
from bumblebee.learning.trial import success_by_family
from bumblebee.motion.clip import Clip
from bumblebee.motion.licences.terms import counted
from bumblebee.policy.card_text import card_text, made_from
from bumblebee.report.wording import plural

SPLITS = {"train": "trained on", "test": "held out"}
GOES_ON = SPLITS | {"test": "held out here, though the policy that it goes on from may have learnt them"}
"""Words of a training that goes on from a policy: only one from nothing has not seen what it holds out."""
_WORST = 5  # motions named that the policy loses first


def card_of(
    learner: Any,
    clips: Sequence[Clip],
    config: dict[str, Any],
    before: pd.DataFrame | None,
    after: pd.DataFrame,
    parent_kept: bool,
    known: Sequence[str],
) -> dict[str, Any]:
    """Facts of a training as plain data.

    Args:
        learner: what trained.
        clips: all motions, with their split.
        config: fields of `TrainConfig`.
        before: trials of the policy that it began from; None for nothing.
        after: trials of the trained policy.
        parent_kept: whether the policy that it began from was kept.
        known: lines of `learnt_before`.
    """
    return {
        "schema": 1,
        "stage": "train",
        "parent": None if before is None else config["start"],
        "learner": learner.name,
        "iterations": learner.iteration,
        "frames": learner.frames,
        "training_clips": [clip.name for clip in clips if clip.split == "train"],
        "before": None if before is None else success_by_family(before),
        "trained": success_by_family(after),
        "kept": "parent" if parent_kept else "child",
        "licences": counted(clip.licence for clip in clips if clip.split == "train"),
        "learnt_before": list(known),
        "config": config,
    }


def readme(card: dict[str, Any], contract: dict[str, Any], trials: pd.DataFrame) -> str:
    """The card as Markdown; `trials` are those of the policy that was kept."""
    how = {"Tried": tried(trials, splits(card["parent"]))}
    return card_text("A policy of `bumblebee train`", contract, how, made_from(card, card["parent"], card["licences"]))


def splits(start: str | Path | None) -> dict[str, str]:
    """Words for the motions of each split; `start` is the policy that the training goes on from."""
    return GOES_ON if start else SPLITS


def tried(trials: pd.DataFrame, splits: Mapping[str, str] = SPLITS, noise: float = 0.0) -> Iterator[str]:
    """Lines on success and errors of each split, and the motions that are lost first; `noise` as in `evaluate`."""
    shaken = f"with {noise:g} times the noise of training" if noise else "without noise"
    yield f"Each motion from its first frame to its last, in MuJoCo at 200 Hz on the declared model, {shaken}:"
    yield ""
    for split, what in splits.items():
        own = trials[trials["split"] == split]
        if not len(own):
            yield f"- {what}: none"
            continue
        names = own["name"].to_numpy()
        rate, key = success_rate(own["success"].to_numpy(), names), mean_by_motion(own["key_error"].to_numpy(), names)
        joint = mean_by_motion(own["joint_error"].to_numpy(), names)
        yield (
            f"- {what}: follows {100 * rate.value:.0f} % of {plural(rate.motions, 'motion')} to the end (95 % interval "
            f"{100 * rate.low:.0f} to {100 * rate.high:.0f}); key bodies {1000 * key.value:.0f} mm off, joints "
            f"{joint.value:.3f} rad"
        )
    lost = trials[~trials["success"]].sort_values("share")
    for row in lost.head(_WORST).itertuples():
        yield f"- loses {row.name} after {100 * np.round(float(row.share), 2):.0f} % of it"
    if len(lost) > _WORST:
        yield f"- and loses {len(lost) - _WORST} more: trials.csv"
