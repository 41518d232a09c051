"""What limits do to the prediction, simulated around an earlier fit: to first order the same around the next one.

A search tries every limit in every round, and nearly all of them change nothing that matters. What a limit of one joint
does hardly depends on an effect that was found on another, so a limit that does not pay by what was simulated before is
not simulated again; one that may pay is.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from bumblebee.diagnosis.problem import Problem
from bumblebee.sim.effects import Effect

Key = tuple[object, ...]


@dataclass(eq=False)
class Changes:
    """Changes of the prediction by limit, size, windows and the effects of its joint, on one set of windows."""

    of: tuple[object, ...] = ()
    """Windows and whitening that they are of: when these are others, nothing is known."""
    kept: dict[Key, tuple[tuple[str, ...], np.ndarray]] = field(default_factory=dict)
    taken: bool = False
    """Whether a change was taken from an earlier fit since this was last set to False."""

    def on(self, problem: Problem) -> "Changes":
        """These, emptied if they are of other windows."""
        if len(self.of) != 2 or self.of[0] is not problem.windows or self.of[1] is not problem.whitener:
            self.of = (problem.windows, problem.whitener)
            self.kept.clear()
        return self

    def get(
        self, effects: Sequence[Effect], place: str, key: Key, fresh: bool, simulate: Callable[[], np.ndarray]
    ) -> np.ndarray:
        """The change `key` of a limit on the joint `place` beside `effects`; simulated if not known, or `fresh`."""
        near = tuple(repr(e) for e in effects if not e.where or place in e.where)
        at, far = (place, near, *key), tuple(map(repr, effects))
        known = self.kept.get(at)
        if known is not None and (not fresh or known[0] == far):
            self.taken |= known[0] != far
            return known[1]
        change = simulate().astype(np.float32)
        self.kept[at] = (far, change)
        return change
