"""How many clusters: the curve that falls with K, and where it bends (paper, section "Cluster Analysis")."""

from itertools import pairwise

import numpy as np
import pandas as pd
from sklearn.metrics import silhouette_score

from bumblebee.clustering.kmeans import kmeans

RULE = "kneedle (Satopaa et al. 2011), sensitivity 1; of several knees the one that bends most"
_SENSITIVITY = 1.0
_SILHOUETTE_CLIPS = 5000  # drawn of more: the silhouette compares every clip with every other


def elbow_curve(latents: np.ndarray, max_k: int = 10, seed: int = 0) -> pd.DataFrame:
    """Columns `k`, `within_ss` (total squared distance to the own centre), `silhouette` (NaN where undefined)."""
    distinct = len(np.unique(latents.round(9), axis=0))
    rows = []
    for k in range(1, min(max_k, distinct) + 1):
        fit = kmeans(latents, k, seed)
        defined = 1 < k < len(latents)
        size = min(len(latents), _SILHOUETTE_CLIPS)
        value = silhouette_score(latents, fit.labels_, sample_size=size, random_state=seed) if defined else np.nan
        rows.append((k, float(fit.inertia_), float(value)))
    return pd.DataFrame(rows, columns=["k", "within_ss", "silhouette"])


def knee(curve: pd.DataFrame) -> int | None:
    """The K at which `within_ss` bends, by kneedle; None where the curve has no elbow.

    Both axes are scaled to 0..1; the difference is how far the curve lies below the straight line between its ends. A
    local maximum of the difference is a knee if, before the next one, the difference falls below that maximum less
    `_SENSITIVITY` times the mean step of K.
    """
    k, within = curve["k"].to_numpy(float), curve["within_ss"].to_numpy(float)
    if len(k) < 3 or within[0] <= within[-1]:
        return None
    across = (k - k[0]) / (k[-1] - k[0])
    below = 1 - across - (within - within.min()) / (within.max() - within.min())
    inner = range(1, len(k) - 1)
    peaks = [i for i in inner if below[i - 1] < below[i] >= below[i + 1]]
    step = _SENSITIVITY * float(np.diff(across).mean())
    knees = [peak for peak, end in pairwise([*peaks, len(k)]) if (below[peak + 1 : end] < below[peak] - step).any()]
    return int(k[max(knees, key=lambda peak: below[peak])]) if knees else None
