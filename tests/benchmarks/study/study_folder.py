"""Inputs of a run, small: motions in clusters and a sealed robot without effects."""

import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import pandas as pd

from benchmarks.motion_pack import Packed, write_pack
from benchmarks.study.motions import LABELS, MOTIONS
from bumblebee.motion.clip import Clip
from bumblebee.motion.embedded import EmbeddedConfig, make_library
from bumblebee.stand_in.sealed import SCHEMA, seal


@cache
def _short() -> list[Clip]:
    library = make_library(EmbeddedConfig(families=("stand", "squat", "jump")))  # the others take twice as long
    return sorted(library, key=lambda clip: clip.frames)


def short_clips(count: int) -> list[Clip]:
    """So many of the shortest motions, made once."""
    return _short()[:count]


def fill(folder: Path) -> None:
    """Six short motions in two clusters, one of each held out; the declared robot below `robots`."""
    clips = short_clips(6)
    splits = ["train", "train", "test"] * 2
    rows = [Packed("made", True, replace(clip, split=split)) for clip, split in zip(clips, splits, strict=True)]
    write_pack(folder / MOTIONS, rows)
    names = [clip.name for clip in clips]
    labels = pd.DataFrame({"name": names, "motion": names, "group": "made", "family": [c.family for c in clips]})
    labels.assign(split=splits, seconds=1.0, cluster=["c0"] * 3 + ["c1"] * 3).to_csv(folder / LABELS, index=False)
    (folder / "robots").mkdir()
    sealed = {"schema": SCHEMA, "sealed": "for a test", "effects": [], "sha256": seal([])}
    (folder / "robots" / "declared.json").write_text(json.dumps(sealed))
