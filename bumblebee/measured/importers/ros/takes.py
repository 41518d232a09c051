"""Series of a recording whose clock was set back or stands still: refused, or cut into takes where the map says so."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import pairwise

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.measured.importers.clock import SPLIT, restarts
from bumblebee.measured.importers.column_map import CLOCKS, ColumnMap
from bumblebee.measured.importers.ros.grid import Series


def require_running(
    where: str, series: list[Series], chosen: ColumnMap, by: Callable[[ColumnMap], list[Series]]
) -> None:
    """Refuse stamps that begin again, since sorting would put the halves into one another, and that stand still.

    Args:
        where: the recording, for messages.
        series: of all topics.
        chosen: the map.
        by: the series by another map, to see which clock runs.
    """
    fault = next(filter(None, map(_fault, series)), None)
    if fault is None:
        return
    topic, came = fault
    split = f"{SPLIT}." if any(restarts(one.stamps) for one in series) else ""
    expected = "stamps that grow from message to message"
    raise BadInput(f"{where}: {topic}", expected, came, next(_clocks_that_run(chosen, by), split))


def _fault(one: Series) -> tuple[str, str] | None:
    """Topic, and what is wrong with its stamps."""
    steps = np.diff(one.stamps)
    again = restarts(one.stamps)
    if again:
        came = f"a step of {steps[again[0] - 1] * 1e-9:.4g} s at message {again[0]}"
        return one.topic, f"{came}, from which on time runs again"
    if len(steps) and np.median(steps) == 0:
        return one.topic, f"the stamp of the message before in {int((steps == 0).sum())} of {len(one.stamps)}"
    return None


def _clocks_that_run(chosen: ColumnMap, by: Callable[[ColumnMap], list[Series]]) -> Iterator[str]:
    for clock in CLOCKS:
        if clock in chosen.clock.values():
            continue
        try:
            if not any(map(_fault, by(replace(chosen, clock={"": clock})))):
                yield f"`time: {clock}` in the map: these stamps grow."
        except BadInput:  # a topic without a header
            continue


def split_takes(series: list[Series]) -> list[list[Series]]:
    """The series of each take: all topics are cut at one place of the file where any topic's stamps begin again.

    A topic's clock is known only by its messages: it was set back between two of them. Where such pieces of the file
    overlap, they tell of one event.
    """
    pieces = sorted(
        (int(one.numbers[row - 1]), int(one.numbers[row])) for one in series for row in restarts(one.stamps)
    )
    cuts: list[tuple[int, int]] = []
    for first, last in pieces:
        if cuts and first < cuts[-1][1]:
            cuts[-1] = (max(first, cuts[-1][0]), min(last, cuts[-1][1]))
        else:
            cuts.append((first, last))
    edges = [-1, *(first for first, _ in cuts), np.iinfo(np.int64).max]
    found = [[_between(one, first, last) for one in series] for first, last in pairwise(edges)]
    return [take for take in found if all(len(one.stamps) for one in take)]


def _between(one: Series, first: int, last: int) -> Series:
    """The messages numbered from `first`, exclusive, to `last`."""
    inside = (one.numbers > first) & (one.numbers <= last)
    return replace(one, stamps=one.stamps[inside], values=one.values[inside], numbers=one.numbers[inside])
