"""How much work a diagnosis does, and how strict it is."""

from dataclasses import dataclass, field

from bumblebee.diagnosis.search_config import SearchConfig


@dataclass(frozen=True)
class DiagnosisConfig:
    """How much work a diagnosis does."""

    horizon: float = 0.2
    """Length of the windows that effects are attributed on [s]."""
    max_windows: int = 120
    """Windows that take part in the fit."""
    max_holdout_windows: int = 60
    """Held-out windows that acceptance is decided on."""
    report_windows: int = 80
    """Windows for each horizon of the error block."""
    max_long_windows: int = 20
    """Windows of 1 s on which an accepted effect must not be worse."""
    grow: bool = True
    """Whether models of few degrees of freedom, which are cheap, get more windows."""
    seed: int = 0
    beyond: bool = True
    """Whether to look for structure that no effect of the catalogue explains, and for its form."""
    beyond_seconds: float = 100.0
    """Time after which nothing more is begun in that search [s]; the notes then say what was not tried.

    For up to 12 degrees of freedom; in proportion longer for more, where every trial is.
    """
    search_seconds: float = 600.0
    """The same for the search among the catalogue's effects; what was found by then is fitted and reported."""
    search: SearchConfig = field(default_factory=SearchConfig)
    """How strict the search is."""
