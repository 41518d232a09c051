"""Residuals that were simulated before: the search asks for the same model again and again."""

from collections import OrderedDict
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from bumblebee.sim.effects import Effect

_KEPT_BYTES = 64e6
Key = tuple[str, ...]


@dataclass(eq=False)
class Recall:
    """The latest residuals of one set of windows, by model and step; the oldest go first."""

    of: tuple[object, ...] = ()
    """What they depend on beside model and step: when it is another one, nothing is known."""
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
