"""How an effect reads in the language of `effects.terms`, in which the diagnosis writes laws that have no name."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

QUANTITIES = ("position", "velocity", "target", "torque", "time", "history")
POSITION, VELOCITY, TARGET, TORQUE, TIME = ((name,) for name in QUANTITIES[:5])
OF_ONE_JOINT = "terms are those of one joint"
STRUCTURE = "it changes the structure"
IN_THE_READINGS = "it is in the readings"
Rows = Iterator[tuple[Any, ...]]
"""Rows of basis functions: texts, quantities, cost; of one with an inner number also that, its family and its reach."""


@dataclass(frozen=True)
class Law:
    """One effect in terms."""

    rows: Callable[[Any, int], Rows]
    """Rows of the law on a joint (an index), from `diagnosis.discrepancy.regressors.Quantities`."""
    family: Literal["", "friction(", "q", "v"]
    """Terms of its constant part, linear part or first harmonic; "": it stays beside every discovered effect."""
    terms: Callable[[np.ndarray, np.ndarray], dict[str, float]] | None = None
    """(its parameters, the declared ones) -> the same torque as terms, for the effects that have a family."""
    driven: bool = False
    """Whether only a joint whose drive gives a torque can have it."""


def waves(frame: str) -> Callable[[float], tuple[str, ...]]:
    """Texts of a harmonic of the position, by its number."""
    return lambda n: tuple(frame.format(f"{f}({n:.4g}*q)") for f in ("sin", "cos"))


def fixed(*rows: tuple[Any, ...]) -> Callable[[Any, int], Rows]:
    """Rows that are alike on every joint."""
    return lambda data, j: iter(rows)
