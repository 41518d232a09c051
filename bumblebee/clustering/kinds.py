"""Kinds of a clip by rules on its numbers alone: labels that were made from neither names nor captions.

They share their inputs with the features of the autoencoder (root, feet, joints), so agreement with them says that the
latents kept such differences, and not that the clusters mean anything.
"""

import numpy as np
import pandas as pd

from bumblebee.motion.clip import TRAVELS

RULES = (
    ("airborne", "no foot on the floor in more than 10 % of the frames, the root up or down at 75 mm/s or more"),
    ("travelling", f"the root gets {TRAVELS:g} m or more from where it starts"),
    ("crouching", "the root comes below 0.62 m; it stands at 0.78 m"),
    ("turning", "the heading covers 90 degrees or more"),
    ("arms", "joints above the legs move at least twice as fast as the legs', and at 0.1 rad/s or more"),
    ("legs", "the legs' joints move at 0.1 rad/s or more"),
    ("still", "none of these"),
)
"""Kind and rule, in this order: the first that holds decides."""


def kinds(statistics: pd.DataFrame) -> np.ndarray:
    """The kind of each clip, (N,) of the names in `RULES`, from the columns that `clip_statistics` gives."""
    upper, lower = statistics["upper_joint"], statistics["lower_joint"]
    holds = [
        (statistics["airborne"] > 0.1) & (statistics["z_move"] >= 2.5),  # motion capture that floats does not bounce
        statistics["displacement"] >= TRAVELS,
        statistics["lowest"] < 0.62,
        statistics["turn"] >= np.pi / 2,
        (upper >= 2 * lower) & (upper >= 0.1),
        lower >= 0.1,
    ]
    return np.select(holds, [name for name, _ in RULES[:-1]], RULES[-1][0])
