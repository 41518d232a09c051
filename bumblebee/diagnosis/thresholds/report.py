"""Numbers that the report goes by."""

from dataclasses import dataclass, field


@dataclass(frozen=True)
class PredictionError:
    """Settings of the error block."""

    resamples: int = 400
    """Bootstrap draws of the rollouts for an interval."""
    whitened: tuple[tuple[str, int], ...] = (("0.02", 60), ("0.2", 40), ("1.0", 12))
    """Horizon [s] and windows of it whose chi-square is taken: the longer, the fewer, for they cost more."""


@dataclass(frozen=True)
class MeasuredCurve:
    """Settings of the mean of a missing torque over one quantity."""

    bins: int = 15
    """Bins of equally many windows."""
    fewest: int = 8
    """Values in a bin below which no mean is given."""


@dataclass(frozen=True)
class Effects:
    """Settings of the list of effects."""

    experiments: int = 3
    """Experiments at most that are proposed to separate one effect from what cannot be told from it."""


@dataclass(frozen=True)
class Unexplained:
    """Settings of the words on what is left."""

    joints: int = 3
    """Joints that get a sentence, and pictures on the page."""


@dataclass(frozen=True)
class Matters:
    """Settings of the headline: what matters, and what is to be trusted."""

    carries: float = 0.02
    """Share of the excess chi-square that returns without an effect, from which on it carries the gain: below, one in
    fifty of what was wrong, it is not told from what the other effects take over."""
    wide: float = 3.0
    """Upper end over lower end of an interval, from which on the size is not known alone: a third to a whole of a
    torque or a gain is a different robot. So is an interval that holds the declared value."""
    structure: float = 0.05
    """Share of what is left, in chi-square above the noise, that a joint's missing torque must explain to be
    proclaimed: with many data less is significant on every real robot, and changes no prediction."""
    told: float = 0.8
    """Share of what is left, or of what a joint's torque laws explain, after which a list is cut."""
    quantities: int = 2
    """Quantities at most that are told of a joint's missing torque where no law says how much each explains."""
    places: int = 4
    """Joints at most that the headline ranks."""
    effectors: int = 3
    """Ends of the chain at most that it ranks."""
    noise: float = 1.05
    """Times the noise floor below which an error leaves nothing to remove: closer, a share divides by the floor's own
    error."""


@dataclass(frozen=True)
class ExampleWindows:
    """Settings of the windows to look at."""

    lengths: tuple[float, ...] = (1.0, 0.6, 0.2)
    """Lengths that are tried, until the logs are long enough [s]."""
    windows: int = 60
    """Windows that the examples are chosen from."""
    ticks: int = 120
    """Points at most that are drawn of one."""
    typical: float = 0.9
    """Quantile of the gain among a joint's windows that is shown: typical, not extreme."""


@dataclass(frozen=True)
class Verdicts:
    """Settings of the verdicts on errors and on what is left."""

    alike: float = 0.004
    """Delays of single joints closer than that are one delay [s]."""
    unseen: float = 10.0
    """Times as far off as the worst fitted window, from which on a window that was not fitted is noted."""
    worse: float = 1.02
    """Times the error before by which the error after has to be larger to be called worse."""
    touch: float = 0.005
    """How far above a surface a point touches it, where readings are noisy [m]."""
    touching: int = 6
    """Rollouts that a note on a surface names."""
    large: float = 3.0
    """Times what sensor noise leaves, from which on an error is called large."""
    trace: float = 1e-3
    """p of what is not called significant for being small, yet is no accident."""
    failures: int = 12
    """Lines on models that could not be made or simulated, which are one cause many times over; then their number."""
    better: float = 0.95
    """Times a joint's error before, below which the error after is coloured as better."""
    joint_worse: float = 1.05
    """Times a joint's error before, above which the error after is coloured as worse."""


@dataclass(frozen=True)
class Listing:
    """Length of the lists on page and terminal."""

    effects: int = 6
    """Effects that the first sentence names."""
    detectable: int = 60
    """Smallest detectable changes on the page."""
    equivalent: int = 4
    """Effects that cannot be told from one, in the terminal."""
    term: int = 60
    """Characters of a term of a law in terminal and page; the whole of it is in effects.yaml."""
    motions: int = 5
    """Worst motions in the terminal."""


@dataclass(frozen=True)
class ReportThresholds:
    """All of them."""

    prediction_error: PredictionError = field(default_factory=PredictionError)
    measured_curve: MeasuredCurve = field(default_factory=MeasuredCurve)
    effects: Effects = field(default_factory=Effects)
    unexplained: Unexplained = field(default_factory=Unexplained)
    matters: Matters = field(default_factory=Matters)
    example_windows: ExampleWindows = field(default_factory=ExampleWindows)
    verdicts: Verdicts = field(default_factory=Verdicts)
    listing: Listing = field(default_factory=Listing)
