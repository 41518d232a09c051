"""Numbers that what lies beyond the catalogue is judged by."""

from dataclasses import dataclass, field


@dataclass(frozen=True)
class TorqueScores:
    """Thresholds for the windows' scores of a torque that a joint lacks."""

    unexplained: float = 1e-3
    """Share of a column's power that must be left conditional on what is explained; with less it is no direction."""
    least_variance: float = 0.25
    """Share of the curvature that the scores' variance has at least: over few windows it may come out far too small."""
    ridge: float = 0.1
    """Share of the mean curvature that is added before a torque is solved for: what noise hides is drawn to zero."""
    rank: float = 1e-4
    """Share of the largest eigenvalue, of scaled columns, below which a direction is none of its own."""
    visible: float = 1e-4
    """Share of the largest eigenvalue below which sensor noise hides a torque: a hundredth of the strongest answer."""


@dataclass(frozen=True)
class Regressors:
    """Thresholds for the quantities that a missing torque may depend on."""

    creep: float = 0.02
    """[rad/s] Speeds below are no motion that dry friction could be told by."""


@dataclass(frozen=True)
class TermLibrary:
    """Grids of the basis functions that are tried: where they begin and end, and how fine they are."""

    cogging_harmonics: tuple[int, ...] = (*range(1, 31), 32, 36, 40, 42, 48, 56, 60, 64, 72, 84, 96)
    """Periods a turn: all low ones, then those of usual numbers of poles, slots and teeth."""
    cogging_travel: float = 0.5
    """Half-turns of a harmonic that a joint must travel: with less it is no wave but a slope."""
    harmonic_reach: float = 0.5
    """[rad] Phase over the whole travel by which a harmonic may move: the next is nearer beyond."""
    stribeck_speeds: tuple[float, ...] = (0.1, 0.3, 1.0)
    """Shares of a joint's RMS speed that a Stribeck curve may fall by."""
    saturation_quantiles: tuple[float, ...] = (0.3, 0.5, 0.7, 0.85, 0.95)
    """Quantiles of the servo's torque at which a limit may be."""
    friction_harmonics: int = 12
    """Periods a turn at most of friction that is uneven along the path."""
    friction_travel: float = 1.5
    """[rad] Phase of a harmonic that a joint must travel for uneven friction."""
    friction_reach: float = 0.5
    """Periods a turn by which a harmonic of friction may move: half the way to the next."""
    rest_times: tuple[float, ...] = (0.1, 0.3, 1.0)
    """[s] Times of rest after which friction is higher."""
    rest_ways: tuple[float, ...] = (0.005, 0.02, 0.08)
    """[rad] Ways after which that is gone."""
    rest_time_ratio: float = 3.0
    """Between neighbouring times of rest: that of the grid."""
    rest_way_ratio: float = 4.0
    """Between neighbouring ways: that of the grid."""
    edge_quantiles: tuple[float, float] = (0.08, 0.92)
    """Quantiles of the position between which a one-sided spring may begin: further out hardly any data are beyond."""
    edges: int = 10
    """Edges of one-sided springs, evenly between these quantiles."""
    dead_band_quantile: float = 0.98
    """Quantile of the tracking error that dead bands are shares of: the largest error may be an accident."""
    dead_bands: tuple[float, float, int] = (0.03, 0.9, 14)
    """Smallest and largest share of that, and how many in between, in geometric steps."""
    dead_band_reach: float = 0.25
    """Share of a band by which it may move: the next of the grid is nearer beyond."""
    slew_rates: tuple[float, float, int] = (0.05, 0.97, 24)
    """Smallest and largest share of the target's fastest move, and how many in between, in geometric steps."""
    slew_reach: float = 0.07
    """Share of a rate by which it may move: the next of the grid is nearer beyond."""
    least_target_steps: float = 2.0
    """Steps over its range at least of a target that arrives in steps."""
    target_steps_apart: float = 0.4
    """Between the numbers of steps that are tried: a stair shifts by as much of a step at the end of the range."""
    least_target_step: float = 1e-3
    """[rad] Of the smallest step that is tried."""
    fastest_beat: float = 12.0
    """[Hz] The fastest beat of a torque by itself that is looked for."""
    beat_step: float = 0.5
    """Periods over a rollout between neighbouring frequencies: what it can tell apart."""
    table_quantiles: tuple[float, float] = (0.02, 0.98)
    """Quantiles of a quantity between which a table's knots are: further out hardly any data hold a height."""
    table_knots: int = 11
    """Knots of a torque over a quantity of the joint or over time."""
    friction_knots: int = 7
    """Knots of dry friction over position."""
    strength_knots: int = 9
    """Knots of the drive's strength over time."""
    coupling_knots: int = 6
    """Knots of a torque over another joint's position or velocity."""


@dataclass(frozen=True)
class StepwiseRegression:
    """Thresholds for the forward selection among all basis functions."""

    level: float = 0.002
    """Probability of a false basis function in a whole dataset, shared among all that are looked at."""
    least_share: float = 0.005
    """Share of the cost that a basis function must take away to be worth a word."""
    coefficient_price: float = 3.0
    """Gain that a further coefficient must bring."""
    tie: float = 6.0
    """Gains [chi-square] that differ by less are the same."""
    tie_share: float = 0.03
    """Gains that differ by a smaller share are the same, too."""
    looked_at: int = 12
    """Best basis functions a step that are tested in full."""
    of_one_kind: int = 5
    """Number of them with one kind of dependence, so that others come up, too."""
    refined: int = 4
    """Number of these whose inner numbers are refined."""
    rival: float = 0.6
    """Share of the best basis function's worth from which on another one is its rival."""
    rivals: int = 2
    """Rivals at most, each of which is refitted in the simulator."""
    refinement: int = 9
    """Inner numbers tried around the best."""
    refinement_rounds: int = 2
    """Rounds of refinement."""
    narrowing: float = 4.0
    """By how much a round's reach is smaller than the one's before: the distance of two that were tried."""
    most: int = 6
    """Basis functions at most that are found in one dataset."""


@dataclass(frozen=True)
class ResidualTests:
    """Thresholds for the tests of what a fit leaves unexplained."""

    least_torque: float = 0.01
    """Share of a joint's typical torque below which a basis function's torque is not worth a word."""
    excess_fitted: float = 4.0
    """Standard errors by which a joint's chi-square must be too large on the fitted windows."""
    excess_validation: float = 1.5
    """Standard errors of the excess on the validation set: it has fewer windows, and confirms."""
    excess_alone: float = 6.0
    """Standard errors of the excess on the fitted windows where there is no validation set."""
    excess_one_rollout: float = 20.0
    """Standard errors of the excess in one rollout, less its loudest windows, from which no second is asked for."""
    rollouts: int = 2
    """Rollouts that must show it where the validation set does not: what one shows may be an accident."""
    loudest: int = 2
    """Windows of a rollout that do not count there: where a foot tips, one holds more than all others."""
    whole_each: float = 2.0
    """Standard errors of all windows' chi-square on the fitted windows and on the validation set, each."""
    whole_both: float = 4.0
    """Standard errors of all windows' chi-square on both sets together."""
    whole_alone: float = 6.0
    """Standard errors of all windows' chi-square on the fitted windows where there is no validation set."""
    met: float = 9.0
    """Chi-square of a basis function on the validation set, below which that does not meet it."""
    half_gain: float = 25.0
    """Gain, in units of the residual's chi-square, on each half of the fitted windows that then counts instead."""
    slight_torque: float = 0.03
    """Share of a joint's typical torque below which a chi-square that no basis function explains is no structure.

    Other steps and integrators feign a hundredth or two of a joint's torque, in contact all windows' chi-square, too.
    """
    hint: float = 3.0
    """z from which on a basis function says what a chi-square that none explains depends on."""
    joints: int = 8
    """Joints that basis functions are sought on, those that lack most: each has thousands."""


@dataclass(frozen=True)
class Form:
    """Thresholds for discrepancy models: basis functions that are refitted in the simulator."""

    many_effects: int = 8
    """Effects in a fit beyond which every trial, that refits them all, is dear.

    Then one joint gets a discrepancy model, the catalogue's effects stay, and inner numbers do, too.
    """
    functions: int = 3
    """Basis functions in a discrepancy model at most."""
    worth: float = 12.0
    """Gain in the criterion that a further one must bring."""
    worth_share: float = 0.03
    """Share of the first ones' gain that a further one must bring."""
    part: float = 0.2
    """Share of an effect of the catalogue that a basis function must be for the effect to be a part of it."""


@dataclass(frozen=True)
class CatalogueTerms:
    """Thresholds for a discrepancy model that acts as an effect."""

    stiff: float = 2.0
    """Times the servo's own gain that a term which acts on the target asks for at most.

    A target that is changed on its way cannot do more than the servo makes of it. Such a coefficient belongs to a term
    that is nearly always zero in the data, and would throw the robot where it is not.
    """


@dataclass(frozen=True)
class SingleLaw:
    """Thresholds for one basis function in a swap for several effects of the catalogue."""

    refined: int = 3
    """Best basis functions whose inner numbers are refined."""
    near: float = 0.9
    """Share of what the effects gain that a basis function at a guess of its inner number must."""
    most_effects: int = 3
    """Effects on a joint, beyond which only all of them together are looked at: the combinations double with each."""


@dataclass(frozen=True)
class CatalogueAlternative:
    """Thresholds for effects of the catalogue in a swap for a discrepancy model."""

    effects: int = 5
    """Effects whose sensitivities are simulated."""
    shapes: int = 2
    """Shapes of each."""
    anywhere: int = 2
    """Number of the most promising of these that may be on other joints."""
    trials: int = 4
    """Number of these that are tried at their size."""
    fits: int = 2
    """Number of these that are refitted jointly."""
    rounds: int = 2
    """Effects of the catalogue that together may take a discrepancy model's place."""
    hopeless: float = 0.5
    """Share of what a discrepancy model gains that one effect may lack; with more no second one is tried."""
    lacking: float = 0.1
    """Share of a discrepancy model's gain that the effects may lack and yet take its place.

    Less is what basis functions differ by whose torques correlate by 0.95.
    """


@dataclass(frozen=True)
class Discover:
    """Thresholds for keeping a discrepancy model."""

    joints: int = 3
    """Joints at most that get one."""
    least_of_all: float = 0.05
    """Share of what all effects gain together that it must gain, what it replaces being gone."""
    most_left: float = 0.5
    """Share of a joint's excess that may remain where its discrepancy model was found."""
    noise: float = 2.0
    """Standard errors of a joint's chi-square that may remain in any case: noise has as many."""
    swaps: int = 2
    """Basis functions tried at most in a swap for the catalogue's effects on one joint."""


@dataclass(frozen=True)
class DiscrepancyThresholds:
    """All of them."""

    torque_scores: TorqueScores = field(default_factory=TorqueScores)
    regressors: Regressors = field(default_factory=Regressors)
    term_library: TermLibrary = field(default_factory=TermLibrary)
    stepwise_regression: StepwiseRegression = field(default_factory=StepwiseRegression)
    residual_tests: ResidualTests = field(default_factory=ResidualTests)
    form: Form = field(default_factory=Form)
    catalogue_terms: CatalogueTerms = field(default_factory=CatalogueTerms)
    single_law: SingleLaw = field(default_factory=SingleLaw)
    catalogue_alternative: CatalogueAlternative = field(default_factory=CatalogueAlternative)
    discover: Discover = field(default_factory=Discover)
