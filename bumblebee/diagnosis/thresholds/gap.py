"""Numbers that the gap report goes by."""

from dataclasses import dataclass, field


@dataclass(frozen=True)
class GainTest:
    """Of the test that a prediction brings the held-out missing torque closer to zero."""

    fewest_blocks: int = 5
    """Blocks of the held-out windows below which nothing is said: ranks of so few cannot be significant."""


@dataclass(frozen=True)
class Dependence:
    """Of the test whether a joint's missing torque depends on anything, by boosted trees."""

    level: float = 0.01
    """False alarms allowed for a whole dataset, shared among the joints; and for the quantities of one joint."""
    least: float = 0.01
    """Share of a joint's typical torque below which structure is not worth a word."""
    clip: float = 5.0
    """Robust standard deviations from which on a missing torque is brought nearer: rare impacts must not decide."""
    tail: float = 1.5
    """Reach of the bulk by which the same bound is widened: a signal's own long tails stay."""
    bulk: float = 0.98
    """Share of the windows that counts as the bulk."""
    iterations: int = 60
    """Trees of an ensemble."""
    learning_rate: float = 0.1
    """Share of what is left that each tree takes."""
    leaves: int = 8
    """Leaves of a tree at most: interactions of two or three quantities, no more."""
    leaf_windows: int = 40
    """Windows in a leaf at least: leaves of few learn the noise."""
    ridge: float = 10.0
    """L2 penalty on the leaves' values."""
    neighbours: int = 6
    """Other joints that are looked at, those that the missing torque goes with most."""
    exchanges: int = 3
    """Times that a quantity's blocks are exchanged to see whether the prediction needs it."""
    shortest_shift: float = 0.25
    """Share of the windows by which blocks are exchanged at least, from either end: not with what is alike nearby."""
    part_of_largest: float = 0.1
    """Share of the most important quantity's loss below which another quantity is not named."""
    lags: int = 10
    """Largest lag of Ljung and Box's test [windows]."""
    lag_pairs: int = 30
    """Pairs of windows of one rollout that a lag must have: correlations of fewer are mostly chance."""


@dataclass(frozen=True)
class MissingTorque:
    """Of the windows that a missing torque is taken from."""

    span: float = 0.04
    """Length of a window, or one tick where ticks are longer [s]."""
    block: float = 0.5
    """What lies closer in one rollout is not taken for independent [s]."""
    simulations: int = 60_000
    """Windows times joints that are simulated at most: each joint is pushed once in every window."""
    fewest: int = 60
    """Windows below which nothing is said."""
    fitted_windows: int = 4000
    """Windows at most that the dependence is learned on."""
    held_windows: int = 2000
    """Windows at most that it is tested on."""
    learned_part: float = 2 / 3
    """Share of a lone rollout that the dependence is learned on; the rest tests it."""
    push: float = 0.1
    """Change of velocity that a free joint gets from the torque by which its impulse response is measured [rad/s]."""
    ridge: float = 1e-3
    """Added to the normal matrix of the scaled impulse responses: a joint that cannot move gets next to no torque."""
    backlash: tuple[float, ...] = (0.01, 0.03, 0.1)
    """Backlash widths whose state is followed along the motion, as shares of the joint's travel."""
    creep: float = 4.0
    """Standard errors of the velocity below which the direction of motion is not known."""
    least_creep: float = 1e-4
    """The same bound at least [rad/s]."""


@dataclass(frozen=True)
class SparseRegression:
    """Of the search for the form of a missing torque."""

    terms: int = 3
    """Terms of a formula at most."""
    z: float = 4.5
    """Standard errors over blocks that a term must exceed: a hundred terms are looked at."""
    level: float = 0.01
    """p that the held-out gain of a term, or of a curve among all curves, must fall below."""
    nearly: float = 0.95
    """Share of the best term's gain that a simpler one must reach to be taken."""
    enough: float = 0.6
    """Share of the trees' held-out gain that counts as the form being found."""
    knots: int = 9
    """Knots of a measured curve."""
    knot_ends: tuple[float, float] = (0.02, 0.98)
    """Quantiles of the first and the last knot: few windows lie outside."""
    curve_better: float = 1.1
    """Times the formula's held-out share that a curve must reach to stand in for it."""
    curve_enough: float = 0.2
    """Share of the trees' held-out gain that a curve must reach."""


@dataclass(frozen=True)
class Library:
    """Of the formulas that are tried, scaled by the data."""

    harmonics: tuple[int, ...] = (
        2, 3, 4, 5, 6, 7, 8, 10, 12, 14, 16, 18, 20, 24, 28, 30, 32, 36, 40, 42, 48, 56, 60, 64, 72, 84, 96,
    )  # fmt: skip
    """Periods a turn that are tried: pole pairs, teeth, and multiples of both."""
    blur: float = 2.0
    """Phase [rad] that a harmonic may run through within a window: faster ones average out."""
    friction_harmonic: int = 8
    """Harmonic up to which friction that varies along the turn is tried."""
    stribeck: tuple[float, ...] = (0.3, 1.0)
    """Stribeck velocities, as shares of the RMS velocity."""
    stops: tuple[float, ...] = (0.25, 0.5, 0.75)
    """Quantiles of the position at which a one-sided spring or friction begins."""
    torque_edges: tuple[float, ...] = (0.5, 0.8)
    """Quantiles of the torque's size from which on it may be too large or too small."""


@dataclass(frozen=True)
class ReportedTorque:
    """Of the comparison with the drive's own torque."""

    latest: float = 0.05
    """Delay up to which the best agreement is sought [s]."""
    fewest: int = 50
    """Rows below which a rollout is not used."""


@dataclass(frozen=True)
class GapPage:
    """Of what the page shows."""

    motions: int = 15
    """Motions that are listed, the worst first."""
    pictures: int = 3
    """Joints whose missing torque is drawn, the most structured first."""


@dataclass(frozen=True)
class GapThresholds:
    """All of them."""

    gain_test: GainTest = field(default_factory=GainTest)
    dependence: Dependence = field(default_factory=Dependence)
    missing_torque: MissingTorque = field(default_factory=MissingTorque)
    sparse_regression: SparseRegression = field(default_factory=SparseRegression)
    library: Library = field(default_factory=Library)
    reported_torque: ReportedTorque = field(default_factory=ReportedTorque)
    page: GapPage = field(default_factory=GapPage)
