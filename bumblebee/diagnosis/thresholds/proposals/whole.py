"""Thresholds of proposals on the whole robot: all joints at once, lost commands, surfaces that it touches."""

from dataclasses import dataclass


@dataclass(frozen=True)
class AllJoints:
    """Thresholds for the standard parameters of all joints, fitted together."""

    windows: int = 60
    """Number of windows used for the coarse fit."""
    steps: int = 9
    """Steps of Levenberg's and Marquardt's way at most."""
    steps_with_links: int = 5
    """Steps of that way with links' masses or fewer dampings, which begin from all joints' effects."""
    rounds: int = 3
    """Rounds of fitting on all windows and taking out what is not sure there; of weighing joints by what is left."""
    delays: int = 11
    """Delays over their whole range between which that of the robot is sought."""
    still_off: float = 2.0
    """Median chi-square that is much: above it the noise does not measure what is sure, and no search begins there."""
    off: float = 4.0
    """Median chi-square on a free base from which on the noise does not measure what is sure."""
    load_takes: float = 0.04
    """Share of the cost that a link's mass must take away beside all joints' effects on a free base; by slopes no
    mass takes more than .002 to .014 where all are right, one to three kilograms on a G1's torso .08 to .42."""
    most_loads: int = 4
    """Masses asked together at most: a trunk, hands and a head."""
    little: float = 0.05
    """Share of the declared model's median chi-square that all joints' effects leave less of where they come first."""
    holding: tuple[float, ...] = (0.005, 0.01, 0.02, 0.04)
    """Shares of a drive's limit that dry friction is tried at where twice the servo's damping or more holds a joint."""
    nearer: float = 0.3
    """Share of the cost that the best effect by itself leaves, which all joints' must leave less of; share of the
    declared model's below which an effect of the whole robot comes first on a free base."""
    one_damping: float = 0.05
    """Share by which the cost may grow where dry friction alone holds a joint."""


@dataclass(frozen=True)
class PacketLoss:
    """Thresholds for commands that never arrived."""

    longest: int = 3
    """Lost commands in a row at most, in ticks."""
    most_ticks: int = 12
    """Ticks of a window: of more the patterns are too many, and single ticks too short to matter."""
    odd_power: float = 1.6
    """Whitened power of a window that a lost command may have spoilt."""
    least_odd: int = 2
    """Such windows, of which there must be as many."""
    few_odd: float = 0.5
    """Share of windows that are odd, below which these alone are asked first."""
    hint: float = 4.0
    """Log-likelihood that these must gain for the others to be asked."""
    most_usual_power: float = 10.0
    """Median power of a model that lacks something in every window: that comes first."""
    most_joints: int = 8
    """Joints up to which losses on single joints are tried."""
    least_gain: float = 8.0
    """Log-likelihood on the fitted windows."""
    held_out_gain: float = 2.0
    """Log-likelihood on the held-out windows."""
    sure_gain: float = 30.0
    """Log-likelihood on the fitted windows that is so sure that the held-out ones need only not contradict."""
    contradiction: float = -3.0
    """Log-likelihood on the held-out windows, below which these contradict: few of them may have any loss."""
    cleared: float = 0.7
    """Share of the excess of log(1 + power) that must go in the windows said to have lost commands."""
    own_explained: float = 0.5
    """Share of the held-out excess of chi-square that must go with a joint's own lost commands.

    Sticking, too, looks like a command that comes late, here and there.
    """
    first_share: float = 0.02
    """Share of lost commands from which expectation and maximisation begin."""
    iterations: int = 60
    """Iterations of expectation and maximisation."""
    rounds: int = 3
    """Rounds of finding nuisances beside the commands that arrived, and these beside the nuisances."""


@dataclass(frozen=True)
class SurfaceContact:
    """Thresholds for contact with a surface that the model lacks: where the robot is when it is further off."""

    off: float = 5.0
    """Times the median power by which the furthest windows must be off."""
    share: float = 0.05
    """Share of the windows that these are."""
    small_robot: int = 12
    """Degrees of freedom up to which it is looked for."""
    many: int = 800
    """Windows that are asked how far they are off and how low the robot comes in them."""
    outputs: int = 5
    """Ticks of each."""
    least_power: float = 1e-6
    """Share of the mean power below which a window counts as no nearer, and its inverse above which as no further."""
    reach: float = 0.8
    """Times the longest link, how far from a body's frame a point is looked for."""
    points: int = 7
    """Places of the point along each axis of the body's frame."""
    least_windows: int = 4
    """Windows that must come below a surface."""
    most_share: float = 0.5
    """Share of the windows that may."""
    z: float = 5.0
    """Standard errors by which these must be further off than the others."""
    deep: float = 0.03
    """How far below the height at which windows begin to be off they may come [m]: a surface gives way by no more."""
    tried: int = 24
    """Points that are tried in the simulator."""
    moved: int = 4
    """Number of these that are moved on."""
    windows: int = 50
    """Windows on which they are: the lowest ones, and as many of the others."""
    heights: tuple[float, ...] = (0.0, 0.25, 0.5, 0.75)
    """Surfaces that are tried, between the lowest place of the point and where windows begin to be off."""
    coarse: float = 0.02
    """First move of a point or a surface [m]; halved where none helps."""
    fine: float = 0.002
    """Last one [m]."""
    moves: int = 25
    """Moves at most."""
    worth: float = 0.003
    """Share of the gain that a move must add: along an axis that no height depends on a point stays."""
    least_gain: float = 60.0
    """Fall of the robust cost of the fit's windows from which on it is proposed."""
    felt: float = 0.1
    """Change of a window's log(1 + power / median) from which on it counts."""
    nearly: float = 0.8
    """Share of these that must gain."""
    nearly_later: float = 0.7
    """Share of these that must gain after 1 s, for a surface that was chosen."""
    least_felt: int = 4
    """Windows of the fitted rollouts that must feel it."""
    least_felt_alone: int = 12
    """Windows that must feel it where no other rollout reaches it."""
    step: float = 0.005
    """Change of the height that matters [m]."""
