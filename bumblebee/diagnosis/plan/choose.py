"""Which of the candidate runs are made: one by one, each the best beside those chosen, then exchanged while it pays."""

from collections.abc import Sequence

import numpy as np

from bumblebee.diagnosis.plan.objective import Objective


def choose(objective: Objective, data: np.ndarray, runs: np.ndarray, count: int, shut: Sequence[int] = ()) -> list[int]:
    """Indices of at most `count` of the runs, best first.

    Args:
        objective: what is maximised.
        data: information (N, N) of what was measured already.
        runs: information (R, N, N) of the candidates.
        count: how many.
        shut: candidates that may not be chosen.
    """
    open_ = [r for r in range(len(runs)) if r not in set(shut)]
    chosen: list[int] = []
    total = data.copy()
    for _ in range(min(count, len(open_))):
        best = _best(objective, total, runs, [r for r in open_ if r not in chosen])
        chosen.append(best)
        total += runs[best]
    for _ in range(objective.rule.exchanges):
        before = list(chosen)
        for k in range(len(chosen)):
            rest = data + runs[[r for r in chosen if r != chosen[k]]].sum(axis=0)
            chosen[k] = _best(objective, rest, runs, [chosen[k], *(r for r in open_ if r not in chosen)])
        if chosen == before:
            break
    return chosen


def _best(objective: Objective, total: np.ndarray, runs: np.ndarray, some: Sequence[int]) -> int:
    """The run that adds most; of equals the first."""
    values = [objective.value(total + runs[r]) for r in some]
    return some[int(np.argmax(np.array(values)))]
