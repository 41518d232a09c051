"""Text-to-motion and motion-to-text retrieval: does the caption find its motion among the held-out ones?

A motion is a held-out window with at least one caption that somebody wrote. A caption's right motions are all windows
that it describes: with two motions of "a person walks", either is right. Ranks go by the cosine of both latents.
"""

from collections.abc import Sequence
from math import comb

import numpy as np

from bumblebee.clustering.estimates import Json, bootstrap, estimate, wilson

AT = (1, 5, 10)
FEW = 30
"""Clips below which the figures say little, whatever their intervals."""


def retrieval(texts: np.ndarray, motions: np.ndarray, pairs: np.ndarray, clips: np.ndarray) -> Json:
    """Both directions, each `{"R@1", "R@5", "R@10", "MedR"}` with `chance`, and how many there are of what.

    Args:
        texts: latents of the distinct captions, (C, Z).
        motions: latents of the windows, (M, Z).
        pairs: (C, M) bool, which caption describes which window; every row and column has one.
        clips: (M,) the clip that each window is of: the intervals are over clips, whose windows are alike.
    """
    near = _unit(texts) @ _unit(motions).T
    first = pairs.argmax(1)  # a caption counts for the first clip that it describes
    return {
        "text_to_motion": direction(near, pairs, clips[first]),
        "motion_to_text": direction(near.T, pairs.T, clips),
        "captions": len(texts),
        "windows": len(motions),
        "clips": len(set(clips.tolist())),
        "few": len(set(clips.tolist())) < FEW,
    }


def direction(near: np.ndarray, right: np.ndarray, clips: np.ndarray) -> Json:
    """Share of queries with a right answer among the first 1, 5, 10, and the median rank of the first right one.

    Args:
        near: similarity of queries and answers, (Q, A).
        right: (Q, A) which answers are right.
        clips: (Q,) the clip of each query; each clip counts the same.
    """
    ranks = first_ranks(near, right)
    answers, good = near.shape[1], right.sum(1)
    names = sorted(set(clips.tolist()))
    own = [ranks[clips == name] for name in names]
    found: Json = {}
    for k in AT:
        share = float(np.mean([(part <= k).mean() for part in own]))
        chance = float(np.mean([hit_by_chance(answers, int(g), k) for g in good]))
        found[f"R@{k}"] = estimate(share, wilson(share, len(own)), len(own)) | {"chance": chance}
    groups = np.arange(len(own))
    interval = bootstrap(groups, lambda rows: float(np.median(np.concatenate([own[i] for i in rows]))))
    found["MedR"] = estimate(np.median(ranks), interval, len(own)) | {"chance": median_by_chance(answers, good)}
    return found | {"answers": answers, "queries": len(near)}


def first_ranks(near: np.ndarray, right: np.ndarray) -> np.ndarray:
    """(Q,) rank, from 1, of the first right answer; a wrong answer that is as near as it comes before it."""
    best = np.where(right, near, -np.inf).max(1, keepdims=True)
    return 1 + ((near >= best) & ~right).sum(1)


def hit_by_chance(answers: int, right: int, k: int) -> float:
    """Probability that a random order has one of the right answers among the first k."""
    return 1 - comb(answers - right, k) / comb(answers, k) if k < answers else 1.0


def median_by_chance(answers: int, right: Sequence[int]) -> int:
    """The least rank that half of the queries reach in random order."""
    counts = {int(g): int((np.asarray(right) == g).sum()) for g in set(np.asarray(right).tolist())}
    reached = (sum(n * hit_by_chance(answers, g, r) for g, n in counts.items()) for r in range(1, answers + 1))
    return next(r for r, value in enumerate(reached, 1) if value >= len(right) / 2)


def _unit(latents: np.ndarray) -> np.ndarray:
    return latents / np.linalg.norm(latents, axis=1, keepdims=True).clip(1e-12)
