"""Card of a policy that `train` wrote: facts for programs (card.json) and for people (README.md)."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from bumblebee.deploy.card_text import card_text, made_from
from bumblebee.evaluation.intervals import mean_by_motion, success_rate
from bumblebee.learning.trial import success_by_family
from bumblebee.motion.clip import Clip
from bumblebee.motion.licence_terms import counted

SPLITS = {"train": "trained on", "test": "held out"}
_WORST = 5  # motions named that the policy loses first


def card_of(
    learner: Any,
    clips: Sequence[Clip],
    config: dict[str, Any],
    before: pd.DataFrame | None,
    after: pd.DataFrame,
    parent_kept: bool,
) -> dict[str, Any]:
    """Facts of a training as plain data.

    Args:
        learner: what trained.
        clips: all motions, with their split.
        config: fields of `TrainConfig`.
        before: trials of the policy that it began from; None for nothing.
        after: trials of the trained policy.
        parent_kept: whether the policy that it began from was kept.
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
        "config": config,
    }


def readme(card: dict[str, Any], contract: dict[str, Any], trials: pd.DataFrame, clips: Sequence[Clip]) -> str:
    """The card as Markdown; `trials` are those of the policy that was kept."""
    licences = counted(clip.licence for clip in clips if clip.split == "train")
    return card_text(
        "A policy of `bumblebee train`", contract, {"Tried": tried(trials)}, made_from(card, card["parent"], licences)
    )


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
            f"- {what}: follows {100 * rate.value:.0f} % of {rate.motions} motions to the end (95 % interval "
            f"{100 * rate.low:.0f} to {100 * rate.high:.0f}); key bodies {1000 * key.value:.0f} mm off, joints "
            f"{joint.value:.3f} rad"
        )
    lost = trials[~trials["success"]].sort_values("share")
    for row in lost.head(_WORST).itertuples():
        yield f"- loses {row.name} after {100 * np.round(float(row.share), 2):.0f} % of it"
    if len(lost) > _WORST:
        yield f"- and loses {len(lost) - _WORST} more: trials.csv"
