"""Soft limit of a search in processor time: running steps finish, later ones are skipped and listed.

The processor's time and not the clock's, of all threads: other programs do not shorten a search, and more cores do not
lengthen it. Near the limit results may still differ from run to run.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, field

EARLY = "early, by `--minutes` or a signal"
"""Words of a note on a search that the user's time or signal ended."""


@dataclass(eq=False)
class Budget:
    """Seconds of this process from its making on; the clock is a parameter so that tests need not wait."""

    seconds: float = float("inf")
    search: str = "beyond the catalogue"
    """Name of what is sought."""
    setting: str = "beyond_seconds"
    """Where the seconds are set."""
    clock: Callable[[], float] = time.process_time
    over: Callable[[int], bool] = lambda effects: False
    """Whether even running steps must end, with so many effects found."""
    found: Callable[[], int] = lambda: 0
    """How many effects are there by now."""
    left_out: list[str] = field(default_factory=list)
    """Work that was not begun, in words, each once."""
    early: bool = field(init=False, default=False)
    """Whether `over` and not the seconds kept something from beginning."""
    began: float = field(init=False)

    def __post_init__(self) -> None:
        self.began = self.clock()

    def ends(self) -> bool:
        """Whether even a running step must end."""
        return self.over(self.found())

    def has_time_for(self, what: str) -> bool:
        """Whether `what` may begin; else it is written down."""
        early = self.ends()
        if self.clock() - self.began <= self.seconds and not early:
            return True
        self.early = self.early or early
        if what not in self.left_out:
            self.left_out.append(what)
        return False

    def notes(self) -> list[str]:
        """A line on what was left out; none where nothing was."""
        if not self.left_out:
            return []
        limit = f"at its limit of {self.seconds:.0f} s of processor time (`{self.setting}`)"
        why = EARLY if self.early else limit
        return [f"the search {self.search} ended {why}; not tried: " + "; ".join(self.left_out)]
