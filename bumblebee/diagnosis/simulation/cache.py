"""Residuals that were simulated before: the search asks for the same model again and again.

Changes of the prediction that were simulated around an earlier fit: to first order the same around the next one.

A search tries the same limits and the same candidates in every round. What one of them does hardly depends on an effect
that was found in another place, so it is simulated again only where something near it has changed by a hundredth.
"""

from collections import OrderedDict
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from bumblebee.sim.effects import Effect

_KEPT_BYTES = 64e6
Key = tuple[str, ...]
ChangeKey = tuple[object, ...]


@dataclass(eq=False)
class Recall:
    """The latest residuals of one set of windows, by model and step; the oldest go first."""

    of: tuple[object, ...] = ()
    """Objects that they depend on beside model and step: when one is another, nothing is known."""
    kept: OrderedDict[Key, np.ndarray] = field(default_factory=OrderedDict)

    def get(
        self,
        of: tuple[object, ...],
        models: Sequence[Sequence[Effect]],
        step: float,
        simulate: Callable[[Sequence[Sequence[Effect]]], np.ndarray],
    ) -> np.ndarray:
        """Residuals (V, ...) of several models; `simulate` is asked for those that are not known."""
        if len(of) != len(self.of) or any(a is not b for a, b in zip(of, self.of, strict=True)):
            self.of = of
            self.kept.clear()
        keys = [(repr(step), *map(repr, effects)) for effects in models]
        new = {key: effects for key, effects in zip(keys, models, strict=True) if key not in self.kept}
        if new:
            self.kept.update((key, one.copy()) for key, one in zip(new, simulate(list(new.values())), strict=True))
        out = np.stack([self.kept[key] for key in keys])
        for key in keys:
            self.kept.move_to_end(key)
        while len(self.kept) > max(1, _KEPT_BYTES / max(1, out[0].nbytes)):
            self.kept.popitem(last=False)
        return out


@dataclass(eq=False)
class Changes:
    """Changes of the prediction by what makes them and the effects near it, on one set of windows."""

    of: tuple[object, ...] = ()
    """Windows and whitening that they are of: when these are others, nothing is known."""
    kept: dict[ChangeKey, tuple[ChangeKey, np.ndarray]] = field(default_factory=dict)
    taken: bool = False
    """Whether a change was taken from an earlier fit since this was last set to False."""

    def on(self, windows: object, whitener: object) -> "Changes":
        """These, emptied if they are of other windows or another whitening."""
        if len(self.of) != 2 or self.of[0] is not windows or self.of[1] is not whitener:
            self.of = (windows, whitener)
            self.kept.clear()
        return self

    def get(
        self,
        effects: Sequence[Effect],
        place: str,
        key: ChangeKey,
        simulate: Callable[[], np.ndarray],
        fresh: bool = False,
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


def _rounded(effect: Effect) -> ChangeKey:
    """Key of an effect, its parameters to two digits."""
    return (effect.effect, effect.where, *(f"{name} {value:.1e}" for name, value in effect.parameters.items()))
