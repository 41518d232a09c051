"""Numbers that the proposals of the search go by: a class a file of `selection/proposals`."""

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Saturation:
    """Of limits of torque, tried at many sizes on the windows that they reach."""

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
    """Of that, what is enough where changes of an earlier fit were taken for this one's, and for trying further."""
    reached: tuple[int, ...] = (1, 2, 4, 7, 12, 24, 50, 100, 200)
    """Windows that the sizes tried reach."""
    below: tuple[float, ...] = (0.7, 0.5, 0.35, 0.25, 0.15, 0.1)
    """Then shares of what the least driven window asks for: a joint that carries a load always asks for some torque."""
    harm: float = 1.5
    """Rise of log(1 + power / s), summed, by each of two sizes from which on no more are tried."""
    enough_windows: int = 12
    """Windows: where no size that reaches up to so many gains, no more are tried."""
    halvings: int = 5
    """Of the interval around the best of the sizes."""
    margin: float = 0.05
    """Share of a size: windows that feel a limit so much weaker are simulated, too, for the fit is not exact."""


@dataclass(frozen=True)
class Backlash:
    """Of backlash, tried at a geometric series of gaps on the windows that are furthest off."""

    most_usual_power: float = 2.0
    """Median chi-square above which all windows are off, for other reasons."""
    first: float = 0.2
    """The smallest gap, as a share of the encoder's noise."""
    ratio: float = 1.35
    """Of one gap to the one before."""
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
    """The same on the windows that were tried, below which the others are not simulated."""
    window_gain: float = 4.0
    """Fall of a window's cost from which on it counts as better."""
    better_windows: int = 3
    """Windows that must be better."""
    largest_share: float = 0.8
    """Share of the whole fall that one window may have."""
    step: float = 0.5
    """Share of the gap that matters: ten times what sensitivities are differences of."""


@dataclass(frozen=True)
class SurfaceContact:
    """Of contact with a surface that the model lacks: where the robot is when it is further off than usual."""

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
    reach: float = 1.2
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
    """Of these that are moved on."""
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
    least_felt: int = 4
    """Windows of the fitted rollouts that must feel it."""
    least_felt_alone: int = 12
    """The same where no other rollout reaches it."""
    step: float = 0.005
    """Change of the height that matters [m]."""


@dataclass(frozen=True)
class JointElasticity:
    """Of elastic joints, tried at a geometric series of stiffnesses; these are in units of the servo's own."""

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
    """Of one stiffness to the next."""
    fine_ratio: float = 1.09
    """The same where the servo reads the joint and shakes it if it is soft: shortly before, the swing lasts long."""
    none: float = 1e-4
    """Of the servo's compliance: as good as stiff."""
    damping: float = 0.1
    """Of the critical one of the rotor on the elastic joint, tried first."""
    loss_factors: tuple[float, float] = (0.6, 1.7)
    """On the damping, tried around the best."""
    least_gain: float = 40.0
    """Fall of the robust cost on all windows from which on elasticity is proposed."""
    least_gain_tried: float = 15.0
    """The same on the windows that were tried, below which the others are not simulated."""
    better_windows: int = 5
    """Windows that must be better."""
    largest_share: float = 0.5
    """Share of the whole fall that one window may have."""
    step: float = 0.2
    """Share of the compliance that matters: five times what sensitivities are differences of."""
    near: float = 2.0
    """Factor on the compliance within which a fitted one is still near the one of the series that it began with."""


@dataclass(frozen=True)
class SetPoints:
    """Of filters, limits and profiles of the targets, tried at a series of sizes."""

    windows: int = 24
    """Windows that the series is tried on, those that are furthest off."""
    factors: tuple[float, ...] = (0.35, 0.7, 1.2, 2.0, 3.2, 5.0, 8.0, 14.0, 25.0)
    """On the size of a first step: of 5 ms they make filters of 2 to 125 ms."""
    speeds: tuple[float, ...] = (1.0, 0.5, 0.25)
    """The same on the speed of a profile that has one."""
    turns: int = 3
    """Times that size and speed are made finer in turn."""
    finer: tuple[float, ...] = (1.25, 1.12, 1.06, 1.03)
    """Factors to both sides of the best so far, one after the other."""
    least_gain: float = 40.0
    """Fall of the robust cost on all windows from which on a set-point is proposed."""
    least_gain_tried: float = 15.0
    """The same on the windows that were tried, below which the others are not simulated."""
    step: float = 0.2
    """Share of the size that matters: five times what sensitivities are differences of."""
    near: float = 0.5
    """Share of the best kind's gain on the windows tried, from which on another kind is refitted, too."""


@dataclass(frozen=True)
class GainGrid:
    """Of servo gains that are far from the declared ones, and dry friction with them."""

    shared: tuple[float, ...] = (1.0, 0.3, 0.1, 0.03, 0.01, 3.0)
    """Factors on kp and on kd of all servos at once, each with each."""
    sweeps: tuple[tuple[float, ...], ...] = (
        (0.3, 0.6, 1.6, 3.0),
        (0.3, 0.6, 1.6, 3.0),
        (0.5, 0.8, 1.25, 2.0),
        (0.7, 0.9, 1.1, 1.4),
        (0.85, 1.15),
    )
    """Factors on the values of each servo, sweep by sweep."""
    dry_shares: tuple[float, ...] = (0.01, 0.03, 0.1)
    """Dry friction tried first, as shares of the servo's torque limit."""
    most_dry: float = 0.5
    """Dry friction at most, as a share of the servo's torque limit."""
    span: float = 1.0
    """[s] length of windows: in a short one gain, damping and friction can stand for each other."""
    windows: int = 36
    """Windows of that length."""
    noise_factor: float = 3.0
    """On the noise, below which errors hardly count."""
    diverged: float = 10.0
    """[rad] error of a simulation that diverged."""
    unlike: float = 0.02
    """Score of a gain that is e times the others', which matters where a servo's own data say next to nothing."""
    least_fall: float = 0.1
    """Fall of the mean score from which on the servos are taken for far off."""
    least_factor: float = 1e-3
    """Smallest factor tried."""
    wrong_factor: float = 2.0
    """Factor by which a kp is wrong that counts as far off."""
    wrong_servos: float = 0.5
    """Share of servos that must be: else one effect may have carried the residuals away."""
    decided_after: int = 2
    """Sweeps after which too few servos that are nearly so wrong end the search."""
    nearly_wrong: float = 1.5
    """Factor on kp that counts as nearly wrong then."""
    nearly: float = 0.5
    """Share of `wrong_servos` that must be nearly wrong then."""
    step: float = 0.1
    """Share of a value that matters: at a hundredth of the declared gain a tenth of that is no small change."""


@dataclass(frozen=True)
class DriveGrid:
    """Of one drive's strength, gain or torque limit by factors, in a large-residual regime."""

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
    """Of the way to the neighbouring factors, to a limit's own size: a coarse one errs by more than the limit does."""


@dataclass(frozen=True)
class AllJoints:
    """Of the usual effects of all joints, fitted together."""

    windows: int = 60
    """Windows that the way from the declared values is gone on."""
    steps: int = 9
    """Steps of Levenberg's and Marquardt's way at most."""
    steps_with_links: int = 5
    """The same with the links' effects, which begin from the joints'."""
    damping: float = 1e-3
    """The least damping, as a share of each parameter's own normal equation."""
    most_damping: float = 100.0
    """Damping from which on no step is left to try."""
    more_damping: float = 10.0
    """Factor on the damping after a step that was no better."""
    less_damping: float = 0.1
    """The same after one that was."""
    settled: float = 0.995
    """Share of the cost that a step must leave less of, or it is the last."""
    free: float = 10.0
    """Changes that matter within which what the data hardly tell stays in one step."""
    rounds: int = 3
    """Rounds of fitting on all windows and taking out what is not sure there."""
    small_robot: int = 12
    """Degrees of freedom up to which the links are asked, too."""
    still_off: float = 2.0
    """Median chi-square beside the joints' effects, from which on they are."""


@dataclass(frozen=True)
class PacketLoss:
    """Of commands that never arrived."""

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
    """Of these."""
    rounds: int = 3
    """Of finding nuisances beside the commands that arrived, and these beside the nuisances."""


@dataclass(frozen=True)
class Stribeck:
    """Of friction that grows at rest and of the dry friction that it sits on."""

    dry_z: float = 3.0
    """Standard errors of the dry friction: as a parameter of the same friction, not one of all candidates."""
    rest: float = 0.6
    """Share of other friction that is left when its level is taken from it."""
    creep: tuple[float, ...] = (0.06, 0.2)
    """Velocities at which friction is tried to grow, as shares of the joint's usual speed."""
    shape_scale: float = 0.3
    """Share of such a velocity that matters."""
    iterations: int = 5
    """Of the joint fit of the two."""


@dataclass(frozen=True)
class HysteresisLaw:
    """Of the two laws of hysteresis, each tried in the place of the other."""

    widths: tuple[float, ...] = (0.25, 0.5, 1.0, 2.0, 4.0, 8.0)
    """Widths of the other law, in those of the one: a spring that yields at a third of Dahl's width is most like it."""
    shape: float = 0.3
    """Share of a width that matters."""
    iterations: int = 4
    """Of the joint refit."""


@dataclass(frozen=True)
class FrictionFamily:
    """Of the sums of a joint's friction."""

    sure: float = 4.0
    """Standard errors that a further member must reach: as a number of the same friction, not one of all candidates."""
    clearly: float = 1.0
    """Log-likelihood by which a sum must be better beyond the price of its numbers."""
    promising: float = 8.0
    """Fall of the cost, in the residual's power, that the screening windows must promise."""
    tried: int = 3
    """Members tried at their size for each that is taken."""
    iterations: int = 3
    """Of the joint refit."""


@dataclass(frozen=True)
class TorqueRipple:
    """Of torque ripple, looked for at all numbers of periods in a turn of the joint."""

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
class GainParameters:
    """Of two effects on one servo's gains."""

    share: float = 1e-3
    """Of what the effects on a joint's gains explain, that fewer may explain less.

    Differences of two simulators are significant, too.
    """


@dataclass(frozen=True)
class DeclaredScale:
    """Of strength, inertia and friction that only one common factor tells apart."""

    iterations: int = 4
    """Steps of the refit at the declared strengths: its start is on the scale, inertias are not yet."""


@dataclass(frozen=True)
class EncoderResolution:
    """Of encoders that read in steps."""

    samples: int = 20_000
    """Readings of a joint at most."""
    smallest: float = 5e-4
    """[rad] the smallest step looked for."""
    cells: int = 12
    """Steps that the joint crosses at least."""
    on_grid: float = 0.8
    """Of the resultant that the noise leaves of a grid: what readings that lie on it have at least."""
    chance: float = 1e-5
    """Of a joint without a grid to look like this."""
    coarsest: float = 0.7
    """Of the largest resultant: a grid's multiples in frequency fit as well as itself, so the lowest is taken."""
    overtones: tuple[int, ...] = (5, 4, 3, 2)
    """Of a grid that is looked for once one of them was found."""
    fewest_cells: int = 3
    """Steps of such a grid that the joint crosses at least."""
    places: int = 40
    """In which the crowd of readings is counted."""
    dense: float = 0.25
    """Distance of the frequencies looked at, as a share of the width of a peak."""


@dataclass(frozen=True)
class JointMisfit:
    """Of joints whose own readings are off in some windows."""

    chance: float = 0.05
    """Of noise to put any window of a joint so far off."""
    joints: int = 2
    """The worst joints at most."""
    windows: int = 16
    """The windows furthest off of each."""


@dataclass(frozen=True)
class ProposalThresholds:
    """All of them."""

    saturation: Saturation = field(default_factory=Saturation)
    backlash: Backlash = field(default_factory=Backlash)
    surface_contact: SurfaceContact = field(default_factory=SurfaceContact)
    joint_elasticity: JointElasticity = field(default_factory=JointElasticity)
    setpoints: SetPoints = field(default_factory=SetPoints)
    gain_grid: GainGrid = field(default_factory=GainGrid)
    drive_grid: DriveGrid = field(default_factory=DriveGrid)
    all_joints: AllJoints = field(default_factory=AllJoints)
    packet_loss: PacketLoss = field(default_factory=PacketLoss)
    stribeck: Stribeck = field(default_factory=Stribeck)
    hysteresis_law: HysteresisLaw = field(default_factory=HysteresisLaw)
    friction_family: FrictionFamily = field(default_factory=FrictionFamily)
    torque_ripple: TorqueRipple = field(default_factory=TorqueRipple)
    gain_parameters: GainParameters = field(default_factory=GainParameters)
    declared_scale: DeclaredScale = field(default_factory=DeclaredScale)
    encoder_resolution: EncoderResolution = field(default_factory=EncoderResolution)
    joint_misfit: JointMisfit = field(default_factory=JointMisfit)
