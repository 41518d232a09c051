"""Changes of the prediction that were simulated around an earlier fit: to first order the same around the next one.

A search tries the same limits and the same candidates in every round. What one of them does hardly depends on an effect
that was found in another place, so it is simulated again only where something near it has changed by a hundredth.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from bumblebee.diagnosis.problem import Problem
from bumblebee.sim.effects import Effect

Key = tuple[object, ...]


@dataclass(eq=False)
class Changes:
    """Changes of the prediction by what makes them and the effects near it, on one set of windows."""

    of: tuple[object, ...] = ()
    """Windows and whitening that they are of: when these are others, nothing is known."""
    kept: dict[Key, tuple[Key, np.ndarray]] = field(default_factory=dict)
    taken: bool = False
    """Whether a change was taken from an earlier fit since this was last set to False."""

    def on(self, problem: Problem) -> "Changes":
        """These, emptied if they are of other windows."""
        if len(self.of) != 2 or self.of[0] is not problem.windows or self.of[1] is not problem.whitener:
            self.of = (problem.windows, problem.whitener)
            self.kept.clear()
        return self

    def get(
        self, effects: Sequence[Effect], place: str, key: Key, simulate: Callable[[], np.ndarray], fresh: bool = False
    ) -> np.ndarray:
        """The change `key` of something at `place` ("": everywhere) beside `effects`.

        It is simulated if it is not known, or is to be `fresh`. Near are effects of that place and of the whole robot.
        """
        near = tuple(_rounded(e) for e in effects if not place or not e.where or place in e.where)
        at, every = (place, near, *key), tuple(map(repr, effects))
        known = self.kept.get(at)
        if known is not None and (not fresh or known[0] == every):
            self.taken |= known[0] != every
            return known[1]
        change = simulate().astype(np.float32)
        self.kept[at] = (every, change)
        return change


def _rounded(effect: Effect) -> Key:
    """What an effect is, its parameters to two digits."""
    return (effect.effect, effect.where, *(f"{name} {value:.1e}" for name, value in effect.parameters.items()))
