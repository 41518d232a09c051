"""Profile likelihood of one parameter, for effects that no slope leads to: what each of several sizes gains.

A limit, a gap and a swing do nothing, or something else, next to where they are. So their sizes are tried one by one,
from where they are felt least, and the neighbourhood of the best is tried again more finely. What a gain is (the fall
of a robust cost, on the windows that feel it) is the proposal's.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

Size = TypeVar("Size")


@dataclass(frozen=True)
class Profile(Generic[Size]):
    """Sizes that were tried, in their order, and their gains."""

    sizes: Sequence[Size]
    gains: Sequence[float]

    @property
    def best(self) -> int:
        """Number of the size that gains most, the first of equals."""
        return int(np.argmax(self.gains))

    @property
    def gain(self) -> float:
        """The largest."""
        return self.gains[self.best]

    @property
    def size(self) -> Size:
        """That of the largest gain."""
        return self.sizes[self.best]

    @property
    def around(self) -> tuple[Size, Size, Size]:
        """The best size between its neighbours; at an end it is its own."""
        return self.sizes[max(self.best - 1, 0)], self.size, self.sizes[min(self.best + 1, len(self.gains) - 1)]


def profile(
    gains: Callable[[Sequence[Size]], Sequence[float]],
    sizes: Sequence[Size],
    ends: Callable[[Sequence[float]], bool] | None = None,
) -> Profile[Size]:
    """Gains of some sizes; all simulated at once, or one by one until what was gained so far `ends` the series."""
    if ends is None:
        return Profile(sizes, list(gains(sizes)))
    found: list[float] = []
    for size in sizes:
        found.extend(gains([size]))
        if ends(found):
            break
    return Profile(sizes[: len(found)], found)


def halved(
    gain: Callable[[float], float], around: tuple[float, float, float], most: float, halvings: int
) -> tuple[float, float]:
    """Size and gain of the best of a few more sizes, halving the wider side of the interval around the best so far."""
    low, middle, high = around
    for _ in range(halvings):
        left = middle - low >= high - middle
        new = 0.5 * (low + middle) if left else 0.5 * (middle + high)
        value = gain(new)
        if value > most:
            low, middle, high, most = (low, new, middle, value) if left else (middle, new, high, value)
        elif left:
            low = new
        else:
            high = new
    return middle, most


def stepped(gain: Callable[[float], float], size: float, most: float, ratios: Sequence[float]) -> tuple[float, float]:
    """Size and gain after steps by ever finer ratios to either side, each taken where it gains more."""
    for ratio in ratios:
        for factor in (ratio, 1 / ratio):
            value = gain(size * factor)
            if value > most:
                size, most = size * factor, value
                break
    return size, most


def reachable(ratios: Sequence[float]) -> list[float]:
    """Every size that `stepped` can ask for from 1 on."""
    sizes = [1.0]
    for ratio in ratios:
        sizes += [size * factor for size in sizes for factor in (ratio, 1 / ratio)]
    return sizes
