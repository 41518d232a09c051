"""Numbers that residuals, whitening and nuisances go by."""

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Whitening:
    """Settings of the noise of readings and starts in a residual."""

    curved: float = 0.5
    """Share of the variance that is not linear in the starts that counts.

    It grows with their variance squared, and what the next readings leave of that is 0.6 to 0.7 on a standing G1.
    """
    stepped: float = 0.3
    """Share of what steps of twice the length change that is a window's own numerical error."""
    explained: float = 3.0
    """Times what such steps change and noise, by root mean square, up to which what is left may be theirs."""
    height_noise: float = 0.002
    """Noise of a base height that is not measured but taken from stance [m]."""


@dataclass(frozen=True)
class InitialState:
    """Settings of starts that are moved to where the readings after them say that they were."""

    outputs: int = 2
    """Compared ticks that say where a window started."""
    most: float = 2.5
    """Standard deviations of its noise that a coordinate may move."""


@dataclass(frozen=True)
class Nuisances:
    """Directions in which two correct simulators differ; a coefficient of 1 is also its prior's deviation."""

    unit: float = 0.001
    """Time that a coefficient of 1 stands for [s]."""
    height: float = 0.001
    """Height of the base that a coefficient of 1 stands for [m]."""
    held_from: float = 2.0
    """Median chi-square by value of what is left, from which on their prior weighs more with it."""


@dataclass(frozen=True)
class EmpiricalCovariance:
    """Settings of the covariance of what a fit leaves, which takes the noise's place."""

    rounds: int = 4
    """Rounds of covariance and weights."""
    fewest: int = 2
    """Windows for each value of a window, below which a covariance says too little."""


@dataclass(frozen=True)
class Outliers:
    """Thresholds for windows that jump or diverge."""

    many: int = 12
    """Windows from which on one is held against the others."""
    largest: float = 0.2
    """Share of the others' power that one window's change may have in coarse steps, on a floating base."""
    diverged: float = 10.0
    """Times the others' root mean square that a window which diverged counts as."""
    impossible: float = 1e9
    """Whitened residual of a model that cannot be made or diverges in every window: above any that can be compared, and
    its square still far below what a float holds."""
    finite: float = 0.5
    """Share of the windows that the declared model must get through; else it is refused."""


@dataclass(frozen=True)
class Sensitivities:
    """Settings of the steps that sensitivities of many candidates are simulated in."""

    damped: float = 2.0
    """Steps times the rate at which a joint is damped, from which on they are too coarse. By servos: 0 to 1.2 on robots
    whose models have their rotors, 0.7 to 30 on models from drawings, which have none."""
    poses: int = 50
    """Windows whose starts are asked for it."""


@dataclass(frozen=True)
class ResidualThresholds:
    """All of them."""

    whitening: Whitening = field(default_factory=Whitening)
    initial_state: InitialState = field(default_factory=InitialState)
    nuisances: Nuisances = field(default_factory=Nuisances)
    covariance: EmpiricalCovariance = field(default_factory=EmpiricalCovariance)
    outliers: Outliers = field(default_factory=Outliers)
    sensitivities: Sensitivities = field(default_factory=Sensitivities)
