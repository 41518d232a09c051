"""Numbers that the joint fit and its intervals go by."""

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Covariance:
    """Of the fitted values' covariance and intervals."""

    enough_rollouts: int = 6
    """Rollouts from which on their differences are believed: fewer say little about how much rollouts differ."""
    backlash_error: float = 0.35
    """Share of a backlash that its interval has at least to either side: five came out at 57 to 93 % of their size."""
    told: float = 1e-6
    """Chi-square of a change that matters, below which the windows say nothing of a parameter."""


@dataclass(frozen=True)
class Jacobian:
    """Of sensitivities that are taken over from an earlier fit."""

    moved: float = 0.2
    """Share of a change that matters: so far a parameter may move before sensitivities near it are simulated again."""


@dataclass(frozen=True)
class ResponseSurface:
    """Of the last step of a fit whose cost is rough."""

    step: float = 0.2
    """Share of a change that matters, to either side: what smooths the jumps and is still linear."""
    rounds: int = 2
    """Rounds, the second around where the first leads; with many parameters only if they leave the points."""
    few: int = 4
    """Parameters up to which the second round is always done."""


@dataclass(frozen=True)
class IntegratorError:
    """Of gains that a change of the integrator alone would bring."""

    explained: float = 0.4
    """Share of an effect's gain from which on it is taken for the integrator's."""
    finite: float = 0.8
    """Share of the windows that another integrator must get through to be asked."""


@dataclass(frozen=True)
class EstimationThresholds:
    """All of them."""

    covariance: Covariance = field(default_factory=Covariance)
    jacobian: Jacobian = field(default_factory=Jacobian)
    response_surface: ResponseSurface = field(default_factory=ResponseSurface)
    integrator_error: IntegratorError = field(default_factory=IntegratorError)
