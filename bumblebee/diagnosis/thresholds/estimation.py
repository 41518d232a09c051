"""Numbers that the joint fit and its intervals go by."""

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Covariance:
    """Thresholds for the fitted values' covariance and intervals."""

    enough_rollouts: int = 6
    """Rollouts from which on their differences are believed: fewer say little about how much rollouts differ."""
    backlash_error: float = 0.35
    """Share of a backlash that its interval has at least to either side: five came out at 57 to 93 % of their size."""


@dataclass(frozen=True)
class Jacobian:
    """Thresholds for sensitivities that are taken over from an earlier fit."""

    moved: float = 0.2
    """Share of a change that matters: so far a parameter may move before sensitivities near it are simulated again."""


@dataclass(frozen=True)
class LevenbergMarquardt:
    """Thresholds for a fit that begins far from the data."""

    damping: float = 1e-3
    """The least damping, as a share of each parameter's own normal equation."""
    most_damping: float = 100.0
    """Damping from which on no step is left to try."""
    more_damping: float = 10.0
    """Factor on the damping after a step that was no better."""
    less_damping: float = 0.1
    """Factor on the damping after a step that was better."""
    settled: float = 0.995
    """Share of the cost that a step must leave less of, or it is the last."""
    free: float = 10.0
    """Changes that matter within which what the data hardly tell stays in one step."""


@dataclass(frozen=True)
class ResponseSurface:
    """Thresholds for the last step of a fit whose cost is rough."""

    step: float = 0.2
    """Share of a change that matters, to either side: what smooths the jumps and is still linear."""
    rounds: int = 2
    """Rounds, the second around where the first leads; with many parameters only if they leave the points."""
    few: int = 4
    """Parameters up to which the second round is always done."""


@dataclass(frozen=True)
class IntegratorError:
    """Thresholds for gains that a change of the integrator alone would bring."""

    explained: float = 0.4
    """Share of an effect's gain from which on it is taken for the integrator's."""
    finite: float = 0.8
    """Share of the windows that another integrator must get through to be asked."""


@dataclass(frozen=True)
class EstimationThresholds:
    """All of them."""

    covariance: Covariance = field(default_factory=Covariance)
    jacobian: Jacobian = field(default_factory=Jacobian)
    levenberg_marquardt: LevenbergMarquardt = field(default_factory=LevenbergMarquardt)
    response_surface: ResponseSurface = field(default_factory=ResponseSurface)
    integrator_error: IntegratorError = field(default_factory=IntegratorError)
