"""Models that could not be made or simulated: one such model must not end a diagnosis, and is not passed over either.

A search asks for thousands of models, of effects that other people's robots were never built for. MuJoCo refuses some
(`FatalError`), our own rules refuse others (`BadInput`), linear algebra refuses what is singular. Such a model explains
nothing: its residual is NaN throughout, for it alone, and what failed is written down and ends in the notes.

So does a step of the search that cannot be computed for another reason, say a normal matrix that is no number: the
search goes on without it.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TypeVar

import mujoco

from bumblebee.errors import BadInput
from bumblebee.sim.effects import Effect

REFUSALS = (mujoco.FatalError, mujoco.UnexpectedError, BadInput, ValueError, ArithmeticError, RuntimeError, LookupError)
"""Exceptions that making or simulating a model may raise because of the model; no others (memory, a typing error).

numpy's LinAlgError is a ValueError, a place that the model lacks a LookupError.
"""

T = TypeVar("T")
NOT_TRIED = "not tried, for the model cannot be simulated"
LEFT_OUT = "left out of the search, for it could not be computed"


@dataclass(eq=False)
class Failures:
    """Failures of one diagnosis, each once."""

    reasons: dict[tuple[str, str], int] = field(default_factory=dict)
    """(effects in words, reason) -> how often."""
    steps: dict[tuple[str, str], int] = field(default_factory=dict)
    """(step of the search, reason) -> how often."""

    def add(self, effects: Sequence[Effect], error: BaseException) -> None:
        """Write down that the declared model with `effects` could not be had."""
        _count(self.reasons, effects_in_words(effects), error)

    def attempt(self, step: str, take: Callable[[], T], instead: Callable[[], T]) -> T:
        """Call `take`, or return `instead` where that fails; the `step` in words is then written down."""
        try:
            return take()
        except REFUSALS as error:
            _count(self.steps, step, error)
            return instead()

    def notes(self, most: int) -> list[str]:
        """A line each for the first `most`, and one on how many more."""
        lines = [f"{LEFT_OUT}: {step} ({n} times): {reason}" for (step, reason), n in self.steps.items()]
        lines += [f"{NOT_TRIED}: {effects} ({n} times): {reason}" for (effects, reason), n in self.reasons.items()]
        more = len(lines) - most
        return [*lines[:most], f"{more} more models or steps of the search failed"] if more > 0 else lines


def _count(seen: dict[tuple[str, str], int], what: str, error: BaseException) -> None:
    key = (what, " ".join(str(error).split())[:300] or type(error).__name__)
    seen[key] = seen.get(key, 0) + 1


def effects_in_words(effects: Sequence[Effect]) -> str:
    """Kinds and places of effects."""
    return ", ".join(f"{e.effect} on {' and '.join(e.where) or 'the whole robot'}" for e in effects) or "no effect"
