"""Models that could not be made or simulated: one such model must not end a diagnosis, and is not passed over either.

A search asks for thousands of models, of effects that other people's robots were never built for. MuJoCo refuses some
(`FatalError`), our own rules refuse others (`BadInput`), linear algebra refuses what is singular. Such a model explains
nothing: its residual is NaN throughout, for it alone, and what failed is written down and ends in the notes.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import mujoco

from bumblebee.errors import BadInput
from bumblebee.sim.effects import Effect

REFUSALS = (mujoco.FatalError, mujoco.UnexpectedError, BadInput, ValueError, ArithmeticError, RuntimeError, LookupError)
"""What making or simulating a model may raise because of the model; anything else (memory, a typing error) is none.

numpy's LinAlgError is a ValueError, a place that the model lacks a LookupError.
"""


@dataclass(eq=False)
class Failures:
    """What failed in one diagnosis, each once."""

    reasons: dict[tuple[str, str], int] = field(default_factory=dict)
    """(effects in words, reason) -> how often."""

    def add(self, effects: Sequence[Effect], error: BaseException) -> None:
        """Write down that the declared model with `effects` could not be had."""
        key = (in_words(effects), " ".join(str(error).split())[:300] or type(error).__name__)
        self.reasons[key] = self.reasons.get(key, 0) + 1

    def notes(self, most: int) -> list[str]:
        """A line each for the first `most`, and one on how many more."""
        lines = [
            f"not tried, for the model cannot be simulated: {effects} ({count} times): {reason}"
            for (effects, reason), count in self.reasons.items()
        ]
        more = len(lines) - most
        return [*lines[:most], f"{more} more combinations of effects could not be simulated"] if more > 0 else lines


def in_words(effects: Sequence[Effect]) -> str:
    """Kinds and places of effects."""
    return ", ".join(f"{e.effect} on {' and '.join(e.where) or 'the whole robot'}" for e in effects) or "no effect"
