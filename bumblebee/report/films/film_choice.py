"""Which motion the film shows: one that failed on the robot before the round and is followed after it."""

from collections.abc import Mapping
from dataclasses import dataclass

import pandas as pd

REFINED, COMPENSATED = "refined", "compensated"


@dataclass(frozen=True)
class Choice:
    """One counted pair of episodes on the stand-in: the same motion from the same start, before and after."""

    motion: str
    cluster: str
    seed: int
    after: str
    """"refined" or "compensated"."""
    fails_at: int
    """Frames that were followed before."""


def won_back(episodes: pd.DataFrame, speed: Mapping[str, float], n: int, parent: int, asked: str = "") -> list[Choice]:
    """The candidates, the liveliest first; refined experts where they won any motion back, else compensated ones.

    Args:
        episodes: data/evaluation/episodes.parquet.
        speed: motion -> mean speed of the root [m/s].
        n: the round.
        parent: the round whose experts ran before it.
        asked: the only motion wanted; "" for any.
    """
    robot = episodes[episodes["engine"] == "stand_in"]
    before = robot[(robot["kind"] == "expert") & (robot["round"] == parent)]
    for called, kind, number in ((REFINED, "expert", n), (COMPENSATED, "compensated", parent)):
        after = robot[(robot["kind"] == kind) & (robot["round"] == number)]
        both = before.merge(after, on=["motion", "seed"], suffixes=("", "_after"))
        won = both[~both["success"].astype(bool) & both["success_after"].astype(bool)]
        won = won[won["motion"] == asked] if asked else won
        if len(won):
            won = won.assign(speed=won["motion"].map(speed).fillna(0.0))
            order = won.sort_values(["speed", "motion", "seed"], ascending=[False, True, True])
            order = order.drop_duplicates("motion")
            return [Choice(r.motion, r.cluster, int(r.seed), called, int(r.frames)) for r in order.itertuples()]
    return []
