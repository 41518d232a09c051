"""How much work a diagnosis does, and how strict it is."""

from dataclasses import dataclass, field

from bumblebee.diagnosis.thresholds import Thresholds


@dataclass(frozen=True)
class SearchConfig:
    """How strict and how long the search is."""

    level: float = 0.005
    """False alarms allowed for a whole null dataset, shared among the candidates (Bonferroni, or by simulation)."""
    screen_windows: int = 40
    """Windows that all candidates are screened on."""
    simulated: int = 10
    """Best candidates of the screening a round, whose sensitivities are simulated on all windows."""
    trials: int = 4
    """Candidates a round that are tried at their size in the simulator."""
    shortlist: int = 2
    """Joints a round on which play and flexible shafts are tried."""
    most: int = 24
    """Effects at most, beside those that the search began with."""
    patience: int = 4
    """Rounds that may fail, one after the other, before the search ends."""
    far: float = 30.0
    """Median chi-square above which the standard parameters of all joints are fitted before anything is found."""
    many: float = 4.0
    """Median chi-square above which, after two effects, the standard parameters of all joints are fitted.

    If the last explained little, or the chi-square is above `far`.
    """


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
    """Windows of 1 s on which an accepted effect must not be worse, of fitted rollouts and of others each."""
    grow: bool = True
    """Whether models that are cheap to simulate get more windows."""
    seed: int = 0
    beyond: bool = True
    """Whether to look for structure that no effect of the catalogue explains, and for its form."""
    beyond_seconds: float = 100.0
    """Processor time after which nothing more is begun in that search [s]; the notes then say what was not tried.

    For up to 12 degrees of freedom; in proportion longer for more, where every trial is.
    """
    search_seconds: float = 600.0
    """Processor time of the search among the catalogue's effects [s]; what was found by then is fitted and reported."""
    search: SearchConfig = field(default_factory=SearchConfig)
    """How strict the search is."""
    thresholds: Thresholds = field(default_factory=Thresholds)
    """Every number that single decisions go by, by room and concept."""
