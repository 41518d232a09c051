"""Charts of rows that answer the mouse: marks placed in percent of a track, so letters keep their size on any screen.

The page draws them with HTML and CSS alone: colours follow the light or dark scheme, and pointing at a row or moving to
it by the keyboard shows its words.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, isfinite


@dataclass(frozen=True)
class Mark:
    """One mark on a row's track; `shape` is "bar", "span", "dot" or "tick", `tone` a class of the page's style."""

    shape: str
    tone: str
    left: float
    """Start in percent of the track."""
    width: float = 0.0
    """Length in percent of the track."""


@dataclass(frozen=True)
class Strip:
    """One row: what it is, its marks, its number, and the words that pointing at it shows."""

    called: str
    marks: tuple[Mark, ...]
    words: str
    tip: str


@dataclass(frozen=True)
class Axis:
    """Linear map from `low` to `high` onto 0 to 100 percent."""

    low: float
    high: float

    def at(self, value: float) -> float:
        """Place of a value [percent]; values outside are put at the end."""
        return 100 * (min(max(value, self.low), self.high) - self.low) / (self.high - self.low)

    def span(self, tone: str, low: float, high: float) -> Mark:
        """An interval."""
        return Mark("span", tone, self.at(low), self.at(high) - self.at(low))

    def bar(self, tone: str, value: float) -> Mark:
        """A bar from zero."""
        return Mark("bar", tone, self.at(0), self.at(value) - self.at(0))

    def point(self, shape: str, tone: str, value: float) -> Mark:
        """A dot or a tick."""
        return Mark(shape, tone, self.at(value))


def axis_over(values: Sequence[float], step: float) -> Axis:
    """Axis that holds zero and all values, with ends at multiples of `step`."""
    there = [value for value in values if isfinite(value)] + [0.0]
    low, high = step * -ceil(-min(there) / step), step * ceil(max(there) / step)
    return Axis(low, high if high > low else low + step)
