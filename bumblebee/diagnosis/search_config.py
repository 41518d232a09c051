"""How strict and how long a search is."""

from dataclasses import dataclass


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
    holdout_z: float = 2.0
    """Held-out gain must exceed this many of its standard errors."""
    least_gain: float = 0.01
    """Held-out gain must exceed this share of what all effects gain together: no law is exactly the catalogue's."""
    far: float = 30.0
    """Median chi-square above which gains far from the declared ones are tried first."""
    many: float = 4.0
    """Median chi-square above which, after two effects, the usual ones of all joints are fitted.

    If the last explained little, or the chi-square is above `far`.
    """
