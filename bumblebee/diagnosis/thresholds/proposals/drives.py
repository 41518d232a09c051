"""Thresholds of proposals on drives: their gains, limits, set-points and the scale of their strength."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Saturation:
    """Thresholds for limits of torque, tried at many sizes on the windows that they reach."""

    odd_power: float = 1.6
    """Whitened power from which on a window is off."""
    reached_first: int = 4
    """Windows that a limit reaches first: one of them must be off, or the limit is not simulated."""
    noise_chance: float = 0.01
    """Chance of noise to put a joint's own readings of one window as far off."""
    least_gain: float = 15.0
    """Fall of the robust cost from which on a limit is proposed."""
    promising_share: float = 2e-3
    """Share of the cost that a size must gain to be looked at closer."""
    earlier_share: float = 0.5
    """Share of that which is enough where an earlier fit's changes were taken for this one's, and to try further."""
    reached: tuple[int, ...] = (1, 2, 4, 7, 12, 24, 50, 100, 200)
    """Windows that the sizes tried reach."""
    below: tuple[float, ...] = (0.7, 0.5, 0.35, 0.25, 0.15, 0.1)
    """Then shares of what the least driven window asks for: a joint that carries a load always asks for some torque."""
    harm: float = 1.5
    """Rise of log(1 + power / s), summed, by each of two sizes from which on no more are tried."""
    enough_windows: int = 12
    """Windows: where no size that reaches up to so many gains, no more are tried."""
    halvings: int = 5
    """Number of times that the interval around the best of the sizes is halved."""
    margin: float = 0.05
    """Share of a size: windows that feel a limit so much weaker are simulated, too, for the fit is not exact."""


@dataclass(frozen=True)
class SetPoints:
    """Thresholds for filters, limits and profiles of the targets, tried at a series of sizes."""

    windows: int = 24
    """Windows that the series is tried on, those that are furthest off."""
    factors: tuple[float, ...] = (0.35, 0.7, 1.2, 2.0, 3.2, 5.0, 8.0, 14.0, 25.0)
    """On the size of a first step: of 5 ms they make filters of 2 to 125 ms."""
    speeds: tuple[float, ...] = (1.0, 0.5, 0.25)
    """Factors on the speed of a profile that has one."""
    turns: int = 3
    """Times that size and speed are made finer in turn."""
    finer: tuple[float, ...] = (1.25, 1.12, 1.06, 1.03)
    """Factors to both sides of the best so far, one after the other."""
    least_gain: float = 40.0
    """Fall of the robust cost on all windows from which on a set-point is proposed."""
    least_gain_tried: float = 15.0
    """Least gain on the windows that were tried, below which the others are not simulated."""
    step: float = 0.2
    """Share of the size that matters: five times what sensitivities are differences of."""
    near: float = 0.5
    """Share of the best kind's gain on the windows tried, from which on another kind is refitted, too."""


@dataclass(frozen=True)
class DriveGrid:
    """Factors on one drive's strength, gain or torque limit, tried in a large-residual regime."""

    factors: tuple[float, ...] = (0.01, 0.03, 0.1, 0.2, 0.5, 2.0, 5.0)
    """Factors on strength and gain that are tried."""
    limits: tuple[float, ...] = (0.003, 0.006, 0.012, 0.025, 0.05, 0.1, 0.2, 0.4, 0.7)
    """Limits that are tried, as shares of the largest torque that was asked for."""
    weak: float = 0.5
    """Factor from which on a drive is weak enough for a limit to be tried in its place."""
    share: float = 0.9
    """Share of the cost that a factor must leave less of."""
    windows: int = 30
    """Windows that all drives are tried on."""
    most: int = 4
    """Parameters that are tried on all windows then."""
    halvings: int = 4
    """Number of halvings on the way to the neighbouring factors: a coarse limit errs by more than the limit does."""


@dataclass(frozen=True)
class GainParameters:
    """Thresholds for two effects on one servo's gains."""

    share: float = 1e-3
    """Share that fewer may explain less of what the effects on a joint's gains explain.

    Differences of two simulators are significant, too.
    """


@dataclass(frozen=True)
class DeclaredScale:
    """Thresholds for strength, inertia and friction that only one common factor tells apart."""

    iterations: int = 4
    """Steps of the refit at the declared strengths: its start is on the scale, inertias are not yet."""
