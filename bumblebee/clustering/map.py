"""Rows of the report's map of motions: where each lies, what it is, and a few poses in few signs."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from bumblebee.clustering.features import POSITIONS
from bumblebee.clustering.material import Material
from bumblebee.clustering.poses import BONES

SIGNS = "".join(chr(code) for code in range(35, 126) if chr(code) not in "&'<>\\")
"""Signs that a number of a pose is written with: printable, and without what HTML or JSON would have to escape."""
STEP = 1.8 / (len(SIGNS) - 1)
"""Between one sign and the next [m]: 2.1 cm; a picture is 1.8 m wide and high, the pelvis in its middle."""
_LONGEST = 160  # letters of a caption


def motion_map(materials: Sequence[Material], labels: pd.DataFrame, most: int) -> pd.DataFrame:
    """Columns name, cluster, x, y, split, family, licence, seconds, caption, caption_source, poses: one row a clip.

    Args:
        materials: of all clips.
        labels: their rows in labels.parquet.
        most: clips that have poses, evenly many of a larger library; the others' are "".
    """
    drawn = set(np.linspace(0, len(materials) - 1, min(most, len(materials))).round().astype(int).tolist())
    table = labels[["name", "cluster", "x", "y", "split", "family"]].copy()
    table["licence"] = [own.licence for own in materials]
    table["seconds"] = np.array([own.seconds for own in materials]).round(1)
    table["caption"] = [(own.captions or ("",))[0][:_LONGEST] for own in materials]
    table["caption_source"] = [own.source for own in materials]
    table["poses"] = [written(own.poses) if i in drawn else "" for i, own in enumerate(materials)]
    return table


def form() -> dict[str, Any]:
    """How to read the poses: the signs, the step between two of them [m], points of a pose, the lines to draw."""
    return {"signs": SIGNS, "step": STEP, "joints": len(POSITIONS), "bones": [list(bone) for bone in BONES]}


def written(poses: np.ndarray) -> str:
    """Poses (P, 15, 2) [m] as two signs a point, across and up, one pose after the other."""
    steps = np.clip(((poses + np.array([0.9, 0.0])) / STEP).round(), 0, len(SIGNS) - 1).astype(int)
    return "".join(SIGNS[step] for step in steps.ravel())
