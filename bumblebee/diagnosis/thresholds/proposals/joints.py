"""Thresholds of proposals on joints: play, elasticity, ripple, encoders' steps, and which joints err."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Backlash:
    """Thresholds for backlash, tried at a geometric series of gaps on the windows that are furthest off."""

    most_usual_power: float = 2.0
    """Median chi-square above which all windows are off, for other reasons."""
    first: float = 0.2
    """The smallest gap, as a share of the encoder's noise."""
    ratio: float = 1.35
    """Ratio of one gap to the one before."""
    count: int = 22
    """Gaps of the series."""
    none: float = 1e-6
    """[rad] a gap as good as none."""
    harm: float = 1.0
    """Rise of log(1 + power / s), summed over the windows tried, from which on a gap only does harm."""
    harmful_sizes: int = 2
    """Gaps that may only do harm, one after the other, before no more are tried."""
    least_gain: float = 30.0
    """Fall of the robust cost on all windows from which on a gap is proposed."""
    least_gain_tried: float = 20.0
    """Least gain on the windows that were tried, below which the others are not simulated."""
    window_gain: float = 4.0
    """Fall of a window's cost from which on it counts as better."""
    better_windows: int = 3
    """Windows that must be better."""
    largest_share: float = 0.8
    """Share of the whole fall that one window may have."""
    step: float = 0.5
    """Share of the gap that matters: ten times what sensitivities are differences of."""


@dataclass(frozen=True)
class JointElasticity:
    """Thresholds for elastic joints, tried at a geometric series of stiffnesses in units of the servo's own."""

    joints: int = 2
    """Joints that are tried where nothing else is worth a trial."""
    least_errors: float = 3.0
    """Standard errors by which a joint's own readings must be off for that."""
    largest_power: float = 4.0
    """Times the noise that a window counts at most for it: a contact spoils a few windows."""
    series_windows: int = 8
    """Windows that the series is tried on."""
    refining_windows: int = 16
    """Windows that the best of it is refined on."""
    stiffest: float = 110.0
    """The first stiffness of the series."""
    finer_below: float = 40.0
    """Stiffness from which on the steps get finer if the encoder is on the joint."""
    softest: tuple[float, float] = (3.0, 8.0)
    """The last stiffness: with the encoder on the motor, on the joint."""
    wide_ratio: float = 1.18
    """Ratio of one stiffness to the next."""
    fine_ratio: float = 1.09
    """Ratio of stiffnesses where the servo reads the joint, which it shakes if soft: before that, swings last long."""
    none: float = 1e-4
    """Share of the servo's compliance that is as good as stiff."""
    damping: float = 0.1
    """Share of the critical damping of the rotor on the elastic joint, tried first."""
    loss_factors: tuple[float, float] = (0.6, 1.7)
    """On the damping, tried around the best."""
    least_gain: float = 40.0
    """Fall of the robust cost on all windows from which on elasticity is proposed."""
    least_gain_tried: float = 15.0
    """Least gain on the windows that were tried, below which the others are not simulated."""
    better_windows: int = 5
    """Windows that must be better."""
    largest_share: float = 0.5
    """Share of the whole fall that one window may have."""
    step: float = 0.2
    """Share of the compliance that matters: five times what sensitivities are differences of."""
    near: float = 2.0
    """Factor on the compliance within which a fitted one is still near the one of the series that it began with."""


@dataclass(frozen=True)
class TorqueRipple:
    """Thresholds for torque ripple, looked for at all numbers of periods in a turn of the joint."""

    joints: int = 2
    """Joints that are asked in a round, those that lack most torque."""
    most: float = 1000.0
    """Periods a turn at most: at 1 rad/s a step of 1 ms is then a sixth of one."""
    phase: float = 0.5
    """[rad] of a wave that the encoder's noise may be at most."""
    dense: float = 0.25
    """Distance of the numbers, as a share of the width of a peak, one wave over the travel."""
    angles: int = 40
    """Angles that a wave is averaged over in each part of a window that has an answer to impulses."""
    tried: int = 2
    """Highest peaks of a joint that are tried in the simulator."""
    iterations: int = 6
    """Steps of the refit of each."""
    together: int = 200
    """Waves whose columns are in memory at once."""


@dataclass(frozen=True)
class EncoderResolution:
    """Thresholds for encoders that read in steps."""

    samples: int = 20_000
    """Readings of a joint at most."""
    smallest: float = 5e-4
    """[rad] the smallest step looked for."""
    cells: int = 12
    """Steps that the joint crosses at least."""
    on_grid: float = 0.8
    """Share of the resultant that the noise leaves of a grid, which readings that lie on it reach at least."""
    chance: float = 1e-5
    """Probability that a joint without a grid looks like this."""
    coarsest: float = 0.7
    """Share of the largest resultant: a grid's multiples in frequency fit as well as itself, so the lowest is taken."""
    overtones: tuple[int, ...] = (5, 4, 3, 2)
    """Overtones of a grid, looked for once one of them was found."""
    fewest_cells: int = 3
    """Steps of such a grid that the joint crosses at least."""
    places: int = 40
    """In which the crowd of readings is counted."""
    dense: float = 0.25
    """Distance of the frequencies looked at, as a share of the width of a peak."""


@dataclass(frozen=True)
class JointMisfit:
    """Thresholds for joints whose own readings are off in some windows."""

    chance: float = 0.05
    """Probability that noise puts any window of a joint so far off."""
    joints: int = 2
    """The worst joints at most."""
    windows: int = 16
    """The windows furthest off of each."""
