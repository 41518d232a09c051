"""Numbers that the use of the logs goes by."""

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Usable:
    """Thresholds for rollouts that windows can be cut from."""

    seconds: float = 0.35
    """Length at least [s]: shorter ones hold no window of 0.2 s after the lead that delayed commands need."""
    rows: int = 12
    """Rows at least."""


@dataclass(frozen=True)
class Conventions:
    """Thresholds for a convention (sign, unit, order) that is wrong in all rollouts, not in single recordings."""

    share: float = 0.5
    """Share of the rollouts that one rule sets aside on one joint, from which on it is a convention."""
    rollouts: int = 3
    """Rollouts at least that it sets aside."""
    moves: float = 0.5
    """Times their median motion that the joint must have in a rollout that passes, to speak against it."""
    follow_span: float = 0.1
    """Time [s] over which changes of a position and its target are compared there, where a sign is in question."""
    follow_correlation: float = 0.3
    """Their correlation from which the joint is seen to follow its target."""


@dataclass(frozen=True)
class TimeSteps:
    """Thresholds for the steps of the simulation."""

    fine: float = 0.001
    """Step for residuals at most [s]."""
    coarse: float = 0.005
    """Step for sensitivities at most [s]."""
    small_model: int = 12
    """Degrees of freedom of the largest robot that is cheap to simulate. A larger one is searched in longer steps (the
    last fit and all that is reported is not) and has more time, in proportion; a smaller one has more windows."""
    search: float = 0.002
    """Step for residuals of the search of larger models at most [s]: it costs half."""
    uneven: float = 0.02
    """Share of a step by which it may be longer: a median of uneven stamps is no whole number of milliseconds."""
    own: float = 0.5
    """Share of the declared model's squared error that its own, longer step must leave at most, to be kept to: logs of
    a simulation of that model have its step's error in them."""
    own_horizon: float = 0.2
    """Length of the windows over which the steps are compared [s]."""
    own_windows: int = 40
    """Number of these windows at most."""


@dataclass(frozen=True)
class Split:
    """Thresholds for the division into fitted and held-out rollouts."""

    every: int = 4
    """Every n-th motion of a cluster is held out."""
    enough: int = 4
    """Rollouts to fit from which on some are put aside to decide which effects are accepted."""
    same: float = 0.1
    """Mean difference of two rollouts' commands over their mean size, below which one repeats the other."""
    length: float = 0.1
    """Relative difference of the durations of repeats at most."""
    samples: int = 200
    """Times at which commands are compared."""
    rows: int = 10
    """Rows from which on commands are compared."""


@dataclass(frozen=True)
class Conditions:
    """Thresholds for what was different when rollouts were recorded."""

    relative: float = 1e-3
    """Relative difference below which two numbers are one value of a condition: 0.205 says 0.204966."""
    told: int = 6
    """Conditions at most that a note lists one by one."""


@dataclass(frozen=True)
class InformativeSplit:
    """Thresholds for the exchange of rollouts that show what no fitted one does."""

    windows: int = 300
    """Windows that are compared with the declared model."""
    far: float = 4.0
    """Times as far off as the worst fitted window that a rollout's windows must be."""
    several: int = 2
    """Windows of the rollout that must be so far off."""
    exchanges: int = 2
    """Rollouts exchanged at most."""


@dataclass(frozen=True)
class Noise:
    """Thresholds for the sensors' noise, estimated from the logs."""

    block: int = 24
    """Rows of a block that the mean square of the fourth difference is taken over."""
    freedom: float = 1 / 2.63
    """Degrees of freedom of a row: successive fourth differences are correlated."""
    quantile: float = 0.25
    """Quantile over the blocks, which keeps fast motion and impacts out."""
    kin: float = 0.3
    """Share of the median noise of its kind that a channel has at least: a far calmer one was probably still."""
    least_place: float = 1e-6
    """Noise of positions [rad, m] and of orientations [rad] at least."""
    least: float = 1e-5
    """Noise of all other signals at least [rad/s, m/s]."""
    moves: float = 1e-7
    """Change from row to row above which a signal has moved [its unit]."""
    resting: float = 0.95
    """Share of the rows below which a quantised signal moves: it often repeats itself."""
    smallest: float = 0.05
    """Quantile of the moves that is the quantisation step: the smallest itself may be rounding."""


@dataclass(frozen=True)
class Smoothing:
    """Thresholds for the local fits that smooth positions and velocities of fast logs."""

    half_span: float = 0.01
    """Time to either side that a fit is over [s]."""
    terms: int = 4
    """Terms of its polynomial: a cubic."""
    spans: int = 4
    """Times the neighbours on one side that a rollout has rows at least."""
    beyond: float = 1.5
    """Half spans within which a neighbour must lie: a gap in the log has no neighbours beyond it."""
    white: float = 0.5
    """Share of their noise that readings must be apart, below which they have the same error."""
    bent: float = 10.0
    """Times the chi-square of readings about their fit, that of noise or of the median fit, above which a motion is no
    cubic: a stiff servo at a step of its command. There they stay as read."""


@dataclass(frozen=True)
class VelocityLatency:
    """Thresholds for velocities that are older than the positions beside them."""

    span: float = 0.15
    """Time over which velocities are integrated [s]."""
    near: float = 0.02
    """Time around its ends from which the positions' velocities are taken [s]."""
    least: float = 1e-3
    """Age beyond which one must be, without doubt [s]: half a step of a simulator is none, and 1 ms is twice that."""
    periods: float = 1.5
    """Periods of the log that an age must exceed where position targets are logged: a servo that answers within a
    period passes for half of one."""
    doubt: float = 4.0
    """Standard errors that make it beyond doubt."""
    most: float = 0.05
    """Age of a reading at most [s]; older velocities are not used."""
    sought: float = 0.3
    """Age up to which velocities are compared with the positions [s]."""
    rounds: int = 3
    """Rounds, each with the velocities moved by what was found before."""
    parts: int = 6
    """Parts of a rollout, which the standard errors take for independent."""


@dataclass(frozen=True)
class DeclaredContacts:
    """Numbers for contacts that the declared model closes in measured poses."""

    windows: int = 1000
    """Poses at most, spread over the rollouts, in which closed contacts are looked for."""


@dataclass(frozen=True)
class Extent:
    """Extent of a diagnosis: how much of the logs and of time it takes."""

    more: float = 2.5
    """Times as many windows at most, for the smallest models."""
    long_window: float = 1.0
    """Length of the long windows on which an accepted effect must not be worse [s]."""
    last_work: float = 270_000.0
    """Steps of a long window times degrees of freedom below which more of them judge the last fit of a small model, in
    inverse proportion."""
    more_last: float = 50.0
    """Times as many at most."""


@dataclass(frozen=True)
class DatasetThresholds:
    """All of them."""

    usable: Usable = field(default_factory=Usable)
    conventions: Conventions = field(default_factory=Conventions)
    time_steps: TimeSteps = field(default_factory=TimeSteps)
    split: Split = field(default_factory=Split)
    conditions: Conditions = field(default_factory=Conditions)
    informative: InformativeSplit = field(default_factory=InformativeSplit)
    noise: Noise = field(default_factory=Noise)
    smoothing: Smoothing = field(default_factory=Smoothing)
    velocity_latency: VelocityLatency = field(default_factory=VelocityLatency)
    contacts: DeclaredContacts = field(default_factory=DeclaredContacts)
    extent: Extent = field(default_factory=Extent)
