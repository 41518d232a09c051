"""Numbers that two models are compared by: a dataclass for each rule, what `compare(...).passes` takes.

Gains of a window are falls of log(1 + chi-square): there a few windows beside an unstable pose do not outvote the rest.
"""

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Validation:
    """Thresholds of acceptance: a fit's gain is on the validation windows, too, and nothing is worse later."""

    z: float = 2.0
    """Standard errors that the gain must exceed."""
    least_share: float = 0.01
    """Share of what all effects gain together that it must reach: no law is exactly the catalogue's."""
    of_rest: float = 0.2
    """Share of what is left that is never a trifle."""
    of_excess: float = 0.5
    """Share of what is left above the noise that is none either, where that is ..."""
    of_noise: float = 0.05
    """... at least this share of the noise: below it differences between integrators are as large."""
    rank_windows: int = 8
    """Windows above which Wilcoxon's ranks are trusted beside the mean."""


@dataclass(frozen=True)
class Later:
    """Whether joint positions after 1 s are further off."""

    growth: float = 0.02
    """Growth of log(1 + error^2) that is none."""
    growth_of_square: float = 0.1
    """Largest growth of error^2, as a share of what it was: of a model that is right but for one window in 100, in
    which a joint swings away, the logarithm sees nothing."""
    z: float = 2.0
    """Standard errors of Student's t beyond which it has grown."""
    windows: int = 3
    """Windows of 1 s below which nothing is said."""


@dataclass(frozen=True)
class WhereFelt:
    """Nearly all windows that the two predict differently must be better.

    The rest of the windows, most of them, knows nothing of a limit: a mean gain over all of them would need many more
    windows that feel it than a limit reaches.
    """

    felt: float = 0.1
    """Change of a window's log(1 + chi-square) from which on it counts."""
    nearly: float = 0.8
    """Share of these that must gain."""
    clear: float = 0.5
    """Sum of their changes that must be reached."""
    least: int = 1
    """Windows that must be better."""


@dataclass(frozen=True)
class WhereRare:
    """Thresholds of an effect that the validation windows cannot judge; several fitted windows decide."""

    unfelt: float = 0.1
    """Share of what a fitted window feels on the mean, below which a validation window cannot judge."""
    felt: WhereFelt = field(default_factory=lambda: WhereFelt(least=4))
    """Thresholds that the fitted windows must meet."""


@dataclass(frozen=True)
class Plausible:
    """A change that few windows feel must take most of their excess over noise."""

    felt: float = 0.1
    """Change of a window's log(1 + chi-square) from which on it counts."""
    several: int = 4
    """Windows that speak for themselves."""
    mostly: float = 0.5
    """Share of the excess that fewer must lose."""


@dataclass(frozen=True)
class Together:
    """Many effects at once must pay by far."""

    fall: float = 0.1
    """Fall of log(1 + chi-square) that they must reach."""
    z: float = 2.0
    """Standard errors that it must exceed."""


@dataclass(frozen=True)
class WindowByWindow:
    """A fit with no more numbers must be better window by window beyond doubt, and no worse after 1 s."""

    z: float = 2.0
    """Standard errors on the validation windows."""
    z_with_fitted: float = 3.0
    """Standard errors where fitted windows count, to which the fits have bent."""
    many_fewer: int = 2
    """Numbers saved, from which on a better fit of all windows need not be beyond doubt."""


@dataclass(frozen=True)
class NoWorseWithinErrors:
    """It must not be worse beyond its standard error, or fit the fitted windows better."""

    z: float = 2.0
    """Standard errors."""


@dataclass(frozen=True)
class NotRefuted:
    """Fitted and validation windows together do not refute a fit with as many numbers (Vuong 1989)."""

    z: float = 2.0
    """Standard errors of the mean loss beyond which a fit is refuted."""


@dataclass(frozen=True)
class NoWorseOnAverage:
    """The validation windows must be no further off on the mean, and not after 1 s either."""


@dataclass(frozen=True)
class Confirmed:
    """Windows that were not fitted must be better by the mean or by ranks."""

    z: float = 2.0
    """Standard errors, or the same chance by ranks."""
    rank_windows: int = 8
    """Windows above which Wilcoxon's ranks are trusted."""


@dataclass(frozen=True)
class Withdrawn:
    """Thresholds for the last check: what stands must not be worse than the declared model."""

    growth: float = 0.02
    """Growth of log(1 + chi-square) that is none."""
    z: float = 2.0
    """Standard errors beyond which it has grown."""


@dataclass(frozen=True)
class Criterion:
    """Criterion that compares fits of different size."""

    parameter: float = 4.0
    """Log-likelihood that a parameter must bring."""


@dataclass(frozen=True)
class Artefact:
    """Gains that the restart from noisy readings makes by itself.

    Where the model restarts a late encoder's joint follows from the mean of two noisy readings: that alone gains
    a little.
    """

    joint_gain: float = 0.1
    """Share of the chi-square of the joint's own signals that a late encoder must gain."""
    robot_gain: float = 0.05
    """Share of the chi-square of all signals that late encoders must gain, all at once."""


@dataclass(frozen=True)
class Elimination:
    """Which effects are dropped beside the others."""

    redundant_z: float = 4.0
    """z below which an effect beside a new one is redundant."""
    sure_z: float = 4.0
    """Standard errors that an effect fitted together with many must reach."""
    sure_z_of_body: float = 5.0
    """Standard errors that masses and centres of mass must reach."""
    unsure_cost: float = 0.2
    """Share by which the cost may grow without all that is not sure, where what goes is simulated."""
    trifle: float = 0.02
    """Share of a change that matters, below which a value is a trifle."""
    near: float = 4.0
    """Reduced chi-square of the validation windows up to which their mean square tells."""
    felt: float = 25.0
    """Chi-square of what an effect changes on the validation windows, below which these say nothing of it."""
    small_share: float = 0.05
    """Share of what all effects gain, above which an effect need not be asked whether it pays."""
    few: int = 4
    """Effects up to which each is asked: of more, each may be a small share, and they were accepted together."""


@dataclass(frozen=True)
class ComparisonThresholds:
    """All of them."""

    validation: Validation = field(default_factory=Validation)
    later: Later = field(default_factory=Later)
    where_felt: WhereFelt = field(default_factory=WhereFelt)
    where_rare: WhereRare = field(default_factory=WhereRare)
    plausible: Plausible = field(default_factory=Plausible)
    together: Together = field(default_factory=Together)
    window_by_window: WindowByWindow = field(default_factory=WindowByWindow)
    no_worse_within_errors: NoWorseWithinErrors = field(default_factory=NoWorseWithinErrors)
    not_refuted: NotRefuted = field(default_factory=NotRefuted)
    no_worse_on_average: NoWorseOnAverage = field(default_factory=NoWorseOnAverage)
    confirmed: Confirmed = field(default_factory=Confirmed)
    withdrawn: Withdrawn = field(default_factory=Withdrawn)
    criterion: Criterion = field(default_factory=Criterion)
    artefact: Artefact = field(default_factory=Artefact)
    elimination: Elimination = field(default_factory=Elimination)
