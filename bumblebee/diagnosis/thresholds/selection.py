"""Numbers that the search for effects goes by; those of its proposals are in `proposals.py`."""

from dataclasses import dataclass, field

from bumblebee.diagnosis.thresholds.comparison import NotRefuted
from bumblebee.diagnosis.thresholds.proposals import ProposalThresholds


@dataclass(frozen=True)
class Forward:
    """Thresholds of the forward selection and its state."""

    anew: float = 0.1
    """Share of the cost left, below which all candidates are screened anew."""
    relinearise: float = 0.8
    """Share of the cost that a fit must leave less of, to be worth linearising around."""
    bound_share: float = 0.7
    """Share of the z to reach that a candidate must reach on a part of the windows to be simulated on all."""
    faint: float = 0.15
    """Share of the best candidate's gain, below which another can wait for a later round."""
    sure: float = 2.0
    """Times the bound's chi-square from which on a screened gain is sure enough to make others wait."""
    many_after: int = 2
    """Effects after which a model that is still far off is taken to lack many."""
    many_at_once: float = 300.0
    """Median chi-square by value, from which on one effect is enough for that."""
    whiten_anew: float = 0.1
    """Share of the median chi-square left, below which windows are whitened anew before many are fitted together."""
    many_little: float = 0.5
    """Share of the reduced chi-square that the last of them took at most."""
    many_patience: int = 2
    """Rounds that may fail once many were fitted together."""
    swaps: int = 3
    """Rounds of swaps at most."""
    most_of_it: float = 0.3
    """Share of the cost that a trial takes away, beside which saturations elsewhere can wait."""


@dataclass(frozen=True)
class Screening:
    """Thresholds for candidates that are worth a trial."""

    second_look: float = 2.5
    """Times as many windows as are screened, from which on a second look is worth it."""
    restless: float = 1.5
    """Reduced chi-square of a joint's torques from which on it is listed for backlash and elasticity."""
    plain: float = 2.0
    """Times the bound's chi-square that it may promise likewise."""
    free: float = 1e-3
    """Share of a step that bounds must leave it to move."""


@dataclass(frozen=True)
class ScoreTests:
    """Thresholds of the score tests of all candidates."""

    seen: float = 1e-3
    """Share of a column's power that must be left beside the chosen ones."""
    least_power: float = 1e-6
    """Power of a column below which it says nothing."""
    lone: float = 1e-6
    """Keeps the variance finite where one window holds all that is known of a candidate."""


@dataclass(frozen=True)
class Trials:
    """Thresholds for candidates tried in the simulator at their size."""

    secants: int = 3
    """Secant steps at most."""
    alike: float = 4.0
    """Costs that differ by less say nothing."""
    parallel: float = 0.97
    """Cosine of two changes of the prediction from which on they are one direction."""
    share: float = 0.03
    """Share of the gain by which costs of parallel changes may differ: their sizes were found in coarse steps."""


@dataclass(frozen=True)
class Swap:
    """Thresholds for one catalogue effect in the place of others."""

    as_much: float = 0.95
    """Share of what the effects gain that a rival must promise."""
    part: float = 0.6
    """Share of what the effects gain that joint elasticity must promise, whose loss has not been fitted yet."""
    rivals: int = 2
    """Rivals tried in the place of the same effects."""
    few: int = 4
    """Effects up to which two are taken out together."""
    clearly: float = 2.0
    """Parameters' worth of log-likelihood by which a rival with as many parameters must be better."""


@dataclass(frozen=True)
class FinalFit:
    """Thresholds of the last fit."""

    sure: float = 3.0
    """z below which an effect is insignificant there."""
    changed: float = 0.85
    """Share of the cost that is left, below which the declared model was far off and windows are whitened anew."""
    rounds: int = 4
    """Rounds of whitening and fitting at most."""
    weighed: int = 6
    """Rounds of weighing windows and fitting at most."""
    still: float = 0.5
    """Share of an interval's half-width: a fit that moves less by whitening has settled."""
    steady: float = 0.1
    """Share of an interval's half-width: a fit that moves less by weighing has settled."""
    same: float = 0.1
    """Mean square change of a window's prediction, in the noise's, below which whitening anew changes nothing."""
    many: int = 30
    """Effects above which slopes are simulated once a round of whitening and hold there, and what goes is followed by a
    refit by the slopes that there are; all of it by one last step."""
    feigned: float = 0.2
    """Share by which the cost may grow without an effect that another integrator would have found as well: where every
    joint of a stiff robot errs, steps move sizes by more than windows bear, and yet no integrator makes them."""


@dataclass(frozen=True)
class SimulationError:
    """Thresholds for values that are moved to where the model predicts best."""

    far: float = 25.0
    """Median chi-square by value of what is left, from which on noise is no measure: readings five times as far off."""
    iterations: int = 8
    """Gauss-Newton's steps at most."""


@dataclass(frozen=True)
class ToldApart:
    """Thresholds for effects with nearly equal sensitivities that plain data tell apart all the same."""

    chi_square: float = 25.0
    """By which a rival must be worse on fitted and validation windows together, and by slopes: five standard errors."""
    windows: NotRefuted = field(default_factory=lambda: NotRefuted(z=3.0))
    """By how many standard errors over windows it must be worse."""
    numerics: float = 0.25
    """Share of what sets them apart that another integrator may make. On some sealed arms up to 0.1 where effects
    differ plainly, 0.15 to hundreds where they are one, which their chi-square shows as well."""
    iterations: int = 6
    """Gauss-Newton's steps at most for the rival."""
    settled: float = 0.5
    """Share of what it is worse by that must be left where further steps would lead."""
    rivals: int = 6
    """Rivals tried in an effect's place, those whose sensitivities differ most first."""
    all_rivals: int = 24
    """Rivals tried in all effects' places together, but one each."""


@dataclass(frozen=True)
class Confounding:
    """Thresholds for effects that these data cannot tell apart."""

    same: float = 0.95
    """Cosine of whitened sensitivities from which on two effects are the same unless a refit tells them apart."""
    told_apart: ToldApart = field(default_factory=ToldApart)
    kin: float = 0.7
    """Cosine from which on they are worth trying in each other's place."""
    rivals: int = 4
    """Rivals tried in an effect's place."""
    all_rivals: int = 16
    """Rivals tried in all effects' places together, but one each."""
    far_worse: float = 6.0
    """Standard errors by which slopes make a rival hopeless."""
    enough: int = 20
    """Windows that can say so."""
    detectable_z: float = 4.0
    """z of the smallest detectable change: seen four times out of five at a bound of about three standard errors."""


@dataclass(frozen=True)
class SelectionThresholds:
    """All of them."""

    forward: Forward = field(default_factory=Forward)
    screening: Screening = field(default_factory=Screening)
    score_tests: ScoreTests = field(default_factory=ScoreTests)
    trials: Trials = field(default_factory=Trials)
    swap: Swap = field(default_factory=Swap)
    final_fit: FinalFit = field(default_factory=FinalFit)
    simulation_error: SimulationError = field(default_factory=SimulationError)
    confounding: Confounding = field(default_factory=Confounding)
    proposals: ProposalThresholds = field(default_factory=ProposalThresholds)
