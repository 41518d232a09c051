"""Which motions a large library is evaluated on: held-out ones first, then every cluster, then evenly."""

import numpy as np
import pandas as pd


def thin(index: pd.DataFrame, most: int) -> list[str]:
    """Names of at most `most` motions (more only where there are more clusters), held-out motions first.

    Held-out motions are scarce and say most, so they take up to half of the room; then every cluster gets at least one
    motion, so that its expert has a result; the rest is spread evenly over the training motions, and what is still free
    goes to held-out ones.

    Args:
        index: columns name, split ("train" or "test"), family, cluster.
        most: the room.
    """
    ordered = index.sort_values(["cluster", "family", "name"])
    held_out, trained = ordered[ordered["split"] == "test"], ordered[ordered["split"] != "test"]
    chosen = _evenly(held_out["name"], most // 2)
    reached = set(ordered["cluster"][ordered["name"].isin(chosen)])
    for cluster, part in ordered.groupby("cluster", sort=True):
        if cluster not in reached:
            own = trained["name"][trained["cluster"] == cluster]
            chosen += _evenly(own if len(own) else part["name"], 1)
    for part in (trained, held_out):
        chosen += _evenly(part["name"][~part["name"].isin(chosen)], most - len(chosen))
    return chosen


def _evenly(names: pd.Series, count: int) -> list[str]:
    """`count` of the names, as far apart in their order as they can be; all of them where there are fewer."""
    count = min(count, len(names))
    places = ((np.arange(max(count, 0)) + 0.5) * len(names) / max(count, 1)).astype(int)
    return [str(name) for name in names.iloc[places]]
