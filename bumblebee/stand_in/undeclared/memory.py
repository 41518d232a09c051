"""Memory of laws, row by row: taken out for the robots that move, put back when they have moved."""

from collections.abc import Iterator, Sequence
from copy import copy
from typing import Any

import numpy as np

from bumblebee.stand_in.undeclared.law import Law
from bumblebee.stand_in.undeclared.signals import Line


def taken(laws: Sequence[Law], rows: np.ndarray) -> list[Law]:
    """The laws with the memory of the robots `rows` (n,) alone, theirs to change."""
    found = [copy(law) for law in laws]
    for law in found:
        for name, value in _memory(law):
            setattr(law, name, _rows(value, rows))
    return found


def put(laws: Sequence[Law], rows: np.ndarray, changed: Sequence[Law]) -> None:
    """Write what the laws of the robots `rows` (n,) now remember into those of all, in place."""
    for law, other in zip(laws, changed, strict=True):
        for name, value in _memory(law):
            _write(value, rows, getattr(other, name))


def _memory(law: Law) -> Iterator[tuple[str, Any]]:
    return ((name, value) for name, value in list(vars(law).items()) if name.startswith("_"))


def _rows(value: Any, rows: np.ndarray) -> Any:
    if isinstance(value, Line):
        line = copy(value)
        line.past = [past[rows] for past in value.past]
        return line
    return value[rows] if isinstance(value, np.ndarray) else value


def _write(value: Any, rows: np.ndarray, new: Any) -> None:
    if isinstance(value, Line):
        for past, now in zip(value.past, new.past, strict=True):
            past[rows] = now
    elif isinstance(value, np.ndarray):
        value[rows] = new
