"""Which effects: score tests of every candidate given those chosen, trials in the simulator, held-out gain, pruning."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.stats import norm

from bumblebee.diagnosis.arrivals import Loss, find_loss
from bumblebee.diagnosis.candidates import Candidate, shortlisted
from bumblebee.diagnosis.far import far_servos
from bumblebee.diagnosis.fit import (
    Fit,
    cost_of,
    effects_at,
    expected_covariance,
    gauss_newton,
    resolved,
    standard_covariance,
)
from bumblebee.diagnosis.gains import plain_gains
from bumblebee.diagnosis.holdout import Holdout
from bumblebee.diagnosis.limits import KINDS as LIMITS
from bumblebee.diagnosis.limits import limit_trials, pays_where_felt
from bumblebee.diagnosis.numerics import beyond_numerics
from bumblebee.diagnosis.problem import Problem, window_weights
from bumblebee.diagnosis.scores import Columns, Scores, as_z, null_maxima, score_tests
from bumblebee.diagnosis.screen import pulse_sizes, restless, screen, screening_windows
from bumblebee.diagnosis.trials import Trial, far_trials, simplest, try_one
from bumblebee.diagnosis.whiten import null_draws
from bumblebee.sim.effects import Effect


@dataclass(frozen=True)
class SearchConfig:
    """How strict and how long the search is."""

    level: float = 0.005
    """False alarms allowed for a whole null dataset, shared among the candidates (Bonferroni, or by simulation)."""
    screen_windows: int = 40
    """Windows that all candidates are screened on."""
    simulated: int = 10
    """Best candidates of the screening a round, whose sensitivities are simulated on all windows."""
    trials: int = 4
    """Candidates a round that are tried at their size in the simulator."""
    shortlist: int = 2
    """Joints a round on which play and flexible shafts are tried."""
    most: int = 12
    """Effects at most."""
    patience: int = 4
    """Rounds that may fail before the search ends."""
    holdout_z: float = 2.0
    """Held-out gain must exceed this many of its standard errors."""
    least_gain: float = 0.01
    """Held-out gain must exceed this share of what all effects gain together: no law is exactly the catalogue's."""
    far: float = 30.0
    """Median chi-square above which gains far from the declared ones are tried first."""


@dataclass(eq=False)
class Step:
    """One accepted effect: the evidence for it when it was accepted."""

    candidate: Candidate
    z: float
    p: float


@dataclass(eq=False)
class Search:
    """Outcome: the final fit and the way there."""

    fit: Fit
    problem: Problem
    """The fitted windows, their nuisances around the fit."""
    weights: np.ndarray
    steps: list[Step]
    screened: Problem
    """The windows that the columns are of."""
    columns: Columns
    """Screening columns of all candidates."""
    tests: Scores
    """Of every candidate of `columns`, given the chosen ones."""
    bound: float
    """z that a candidate had to reach."""
    count: int
    """Candidates among which the false alarms are shared."""
    rejected: list[str] = field(default_factory=list)
    loss: Loss | None = None
    """Commands that never arrived; the windows then have those that did."""


_ANEW = 0.1  # share of the cost left, below which all candidates are screened anew
_SPRINGS = {"joint_spring", "asymmetric_friction"}
_MUCH = 0.15  # share of the cost
# Where the model restarts a late encoder's joint follows from noisy readings: that alone gains a little.
_NOISY, _NOISY_GAIN = ("encoder_delay",), 0.02
_CHANGED = 0.8  # share of the cost that a fit must leave less of, to be worth linearising around


class _Run:
    """The state of one search."""

    def __init__(
        self,
        problem: Problem,
        holdout: Holdout,
        remake: Callable[[Sequence[Effect]], tuple[list[Candidate], np.ndarray]],
        config: SearchConfig,
        say: Callable[[str], None],
    ) -> None:
        self.problem, self.holdout, self.remake, self.config, self.say = problem, holdout, remake, config, say
        start = problem.residual([[]])[0]
        self.weights = window_weights(start)
        self.fit = gauss_newton(problem, (), (), self.weights)
        self.keep = screening_windows(problem, config.screen_windows)
        self.closed: set[Candidate] = set()
        self.steps: list[Step] = []
        self.rejected: list[str] = []
        self.loss: Loss | None = None
        self.given = 0
        self.candidates, _ = remake([])
        self.start_far()
        self.rescreen()
        self.bound = self._bound()

    def rescreen(self) -> None:
        """Candidates with steps for the present fit, and the columns of all of them around it."""
        self.small = self.problem.part(self.keep)
        self.candidates, torque = self.remake(self.fit.effects)
        self.columns, self.answers = screen(
            self.small, self.candidates, self.fit.effects, pulse_sizes(self.problem, torque)
        )
        self.screened_cost = self.fit.cost

    def _bound(self) -> float:
        """The z for the level over all candidates: Bonferroni's, or that of simulated null datasets if higher."""
        level, count = self.config.level, len(self.candidates)
        draws = null_draws(self.small.whitener, self.small.sigma, np.random.default_rng(0))
        maxima = null_maxima(self.small, self.columns, self.small_fit(), np.ones(len(self.keep)), draws)
        scale = maxima.std() * np.sqrt(6) / np.pi  # a Gumbel distribution of the same mean and variance
        simulated = maxima.mean() - scale * (np.euler_gamma + np.log(-np.log1p(-level)))
        return float(max(norm.isf(level / (2 * count)), simulated))

    def small_fit(self) -> Fit:
        """The fit on the screening windows."""
        return replace(self.fit, residual=self.fit.residual[self.keep], columns=self.fit.columns[:, self.keep])

    def tests(self) -> Scores:
        """Score tests of all candidates on the screening windows."""
        return score_tests(self.small, self.columns, self.small_fit(), self.weights[self.keep])

    def promising(self) -> list[Candidate]:
        """The best of the screening, and play and shafts of the joints that are worst explained."""
        tests = self.tests()
        share = np.sqrt(len(self.keep) / len(self.problem.windows))
        found = []
        for k in np.argsort(-tests.gain):
            c = self.columns.candidates[k]
            if len(found) >= self.config.simulated or tests.gain[k] <= 0:
                break
            if self.is_open(c, tests, k, 0.7 * share * self.bound, share**2) and not _like(c, found):
                found.append(c)
        left = self.small_fit().clean(self.small)
        poor = restless(self.small, self.answers, left, self.config.shortlist)
        joints = len(self.problem.plant.joints)
        listed = [c for c in self.candidates if c.where in poor and shortlisted(c, joints)]
        return found + [c for c in listed if c not in self.closed and not self._chosen(c)]

    def _chosen(self, c: Candidate) -> bool:
        """Whether it is chosen, or something on its place that one spring of MJCF cannot be as well."""
        there = {o.effect for o in self.fit.chosen if o.where == c.where}
        if c.effect in there:
            return True
        return bool((c.effect == "hysteresis" and there & _SPRINGS) or (c.effect in _SPRINGS and "hysteresis" in there))

    def is_open(self, c: Candidate, tests: Scores, k: int, bound: float, share: float) -> bool:
        """Whether a candidate is significant, can move the way it wants to, and has not been tried in vain.

        One that promises much of the whole cost is tried, too: where a few windows are very far off they decide its
        variance, and only the fit with it, in which they are not, can say how sure it is. `share` is that of the
        windows the tests were made on.
        """
        if c in self.closed or self._chosen(c):
            return False
        much = tests.gain[k] > _MUCH * share * self.fit.cost
        return bool(tests.z[k] >= bound or much) and any(_can_move(c, tests.steps[k]))

    def trials(self) -> tuple[list[Trial], list[Candidate]]:
        """Candidates tried in the simulator with their costs; and those that were looked at."""
        looked = self.promising()
        if not looked:
            return [], []
        columns = Columns(looked, self.problem.sensitivities(looked, self.fit.effects))
        tests = score_tests(self.problem, columns, self.fit, self.weights)
        order = [k for k in np.argsort(-tests.gain) if self.is_open(looked[k], tests, k, self.bound, 1.0)]
        tried = [
            try_one(self.problem, self.fit, looked[k], tests.steps[k], self.weights)
            for k in order[: self.config.trials]
        ]
        return [t for t in tried if t is not None and t.cost < self.fit.cost - self.bound**2 / 2], looked

    def accept(self, candidate: Candidate, values: np.ndarray) -> bool:
        """Refit with the candidate; keep it if the joint fit and the held-out windows agree."""
        chosen, start = (*self.fit.chosen, candidate), np.concatenate((self.fit.values, values))
        # Windows that only this effect explains weighed little so far: weigh them as it leaves them.
        residual = self.problem.residual([effects_at(chosen, start)])[0]
        weights = window_weights(residual - np.tensordot(self.fit.nuisance, self.problem.nuisance, axes=1))
        fit = gauss_newton(self.problem, chosen, start, weights, iterations=2, coarse=True)
        z = wald(self.problem, fit, weights, len(fit.chosen) - 1)
        p = min(1.0, 2 * norm.sf(z) * len(self.candidates))
        pays = self.holdout.gains(self.fit, fit, self.config.holdout_z, self.config.least_gain) or (
            candidate.effect in LIMITS and pays_where_felt(self.problem, self.holdout, self.fit, fit)
        )
        if z < self.bound or not pays or not self.is_physical(candidate, fit, weights):
            self.closed.add(candidate)
            self.rejected.append(f"{candidate.effect} on {candidate.where or 'the whole robot'}")
            return False
        self.steps.append(Step(candidate, z, p))
        self.say(f"found {candidate.effect} on {candidate.where or 'the whole robot'}: {fit.of(candidate).round(5)}")
        self.renew(fit)
        return True

    def is_physical(self, candidate: Candidate, fit: Fit, weights: np.ndarray) -> bool:
        """Whether neither another integrator nor the readings' noise would do what the new fit gains."""
        if candidate.effect in _NOISY:
            before = cost_of(self.problem, self.fit.residual, weights)[0]
            if before - fit.cost < _NOISY_GAIN * before:
                return False
        return beyond_numerics(self.problem, self.fit, fit, weights)

    def renew(self, fit: Fit) -> None:
        """Nuisances around what was found, where it is more than a little; weights; candidates, where it is a lot."""
        if cost_of(self.problem, fit.residual, self.weights)[0] < _CHANGED * self.fit.cost:
            self.problem = self.problem.relinearised(fit.effects)
            self.holdout = self.holdout.relinearised(fit.effects)
        self.weights = window_weights(fit.clean(self.problem))
        self.fit = resolved(self.problem, fit, self.weights)
        self.small = self.problem.part(self.keep)
        if self.fit.cost < _ANEW * self.screened_cost:
            self.rescreen()

    def start_far(self) -> bool:
        """Begin with servos far from the declared ones, where the data are that far from the model."""
        if float(np.median((self.fit.residual**2).mean(axis=1))) < self.config.far:
            return False
        found = far_servos(self.problem, self.candidates)
        if not found:
            return False
        chosen, values = [c for c, _ in found], np.array([v for _, v in found])
        weights = window_weights(self.problem.residual([effects_at(chosen, values)])[0])
        fit = gauss_newton(self.problem, chosen, values, weights, iterations=0, coarse=True)
        if not self.holdout.gains(self.fit, fit, self.config.holdout_z, self.config.least_gain):
            return False
        for i, c in enumerate(fit.chosen):
            z = wald(self.problem, fit, weights, i)
            self.steps.append(Step(c, z, min(1.0, 2 * norm.sf(z) * len(self.candidates))))
            self.say(f"found {c.effect} on {c.where}, far from the declared: {fit.of(c).round(5)}")
        self.screened_cost = 0.0
        self.renew(fit)
        self.given = len(fit.chosen)
        return True

    def find_loss(self) -> bool:
        """Look for commands that never arrived; if some did not, go on with those that did."""
        found = None if self.loss else find_loss(self.problem, self.holdout, self.fit)
        if found is None:
            return False
        self.loss, self.problem, self.holdout = found
        self.say(f"found lost commands on {self.loss.where or 'the whole robot'}: {self.loss.share:.4f}")
        self.closed.clear()
        chosen, values = self.fit.chosen, self.fit.values
        self.fit = gauss_newton(self.problem, chosen, values, self.weights, iterations=2, coarse=True)
        self.renew(self.fit)
        self.rescreen()
        return True

    def prune(self) -> None:
        """Drop effects that the others have made needless, worst first, refitting each time.

        One whose loss the others cannot make up for stays, however little the slopes at the fit say of it: far from
        the declared value they say nothing of the way back.
        """
        kept: set[Candidate] = set()
        while len(kept) < len(self.fit.chosen):
            fit = self.fit
            z = [np.inf if c in kept else wald(self.problem, fit, self.weights, i) for i, c in enumerate(fit.chosen)]
            worst = int(np.argmin(z))
            if z[worst] >= self.bound:
                break
            keep = [i for i in range(len(fit.chosen)) if i != worst]
            values = [fit.values[fit.slices[i]] for i in keep]
            chosen = [fit.chosen[i] for i in keep]
            values = np.concatenate(values) if values else []
            less = gauss_newton(self.problem, chosen, values, self.weights, iterations=2, coarse=True)
            if is_worse(self.problem, fit, less, self.bound) or self.holdout.worse_later(fit.effects, less.effects):
                kept.add(fit.chosen[worst])
                continue
            self.say(f"needless: {fit.chosen[worst].effect} on {fit.chosen[worst].where}")
            self.fit = less

    def plain(self) -> None:
        """Effects on a servo's gains in their plainest form, with evidence for those that are new."""
        if self.given:  # kp and kd apart from the start on
            return
        self.fit = plain_gains(self.problem, self.fit, self.candidates, self.weights, self.bound, self.say)
        for i, c in enumerate(self.fit.chosen):
            if c not in {s.candidate for s in self.steps}:
                z = wald(self.problem, self.fit, self.weights, i)
                self.steps.append(Step(c, z, min(1.0, 2 * norm.sf(z) * len(self.candidates))))


def _can_move(c: Candidate, steps: np.ndarray) -> list[bool]:
    """For each free parameter, whether the wanted change is not stopped by a bound."""
    wanted = np.array(c.nominal)
    wanted[list(c.free)] += np.asarray(steps) * np.array(c.step)[list(c.free)]
    reached = np.abs(c.clip(wanted) - np.array(c.nominal))
    return [bool(reached[i] > 1e-3 * abs(c.step[i])) for i in c.free]


def _like(c: Candidate, others: Sequence[Candidate]) -> bool:
    """Whether two of the same kind on the same place are already there, in other shapes."""
    return sum((c.effect, c.where) == (o.effect, o.where) for o in others) >= 2


def is_worse(problem: Problem, fit: Fit, less: Fit, z: float) -> bool:
    """Whether an effect less costs more than one of `z` standard errors is worth, at the residual's power."""
    power = max(float(np.median((fit.clean(problem) ** 2).mean(axis=1))), 1.0)
    return less.cost - fit.cost > 2.0 * z**2 * power


def wald(problem: Problem, fit: Fit, weights: np.ndarray, index: int) -> float:
    """The z of one chosen effect's free parameters in the joint fit."""
    candidate, part = fit.chosen[index], fit.slices[index]
    free = part.start + np.array(candidate.free)
    # Windows that feel a limit are too few for a variance between windows.
    of = expected_covariance if candidate.effect in LIMITS else standard_covariance
    covariance = of(problem, fit, weights)[np.ix_(free, free)]
    away = fit.values[free] - np.array(candidate.nominal)[list(candidate.free)]
    value = float(away @ np.linalg.pinv(covariance, rcond=1e-9, hermitian=True) @ away)
    return as_z(value, len(free), len(weights))


def search(
    problem: Problem,
    holdout: Holdout,
    remake: Callable[[Sequence[Effect]], tuple[list[Candidate], np.ndarray]],
    config: SearchConfig,
    say: Callable[[str], None] = lambda text: None,
) -> Search:
    """Forward selection with joint refits, then pruning.

    `remake` gives the candidates with steps for a model with some effects, and its joints' typical torques (J,) [N m].
    """
    run = _Run(problem, holdout, remake, config, say)
    _select(run, config)
    if run.find_loss():
        _select(run, config)
    run.prune()
    run.plain()
    steps = [s for s in run.steps if s.candidate in run.fit.chosen]
    return Search(
        run.fit,
        run.problem,
        run.weights,
        steps,
        run.small,
        run.columns,
        run.tests(),
        run.bound,
        len(run.candidates),
        run.rejected,
        run.loss,
    )


def _select(run: _Run, config: SearchConfig) -> None:
    """Forward selection until nothing is worth a trial, or too many were in vain."""
    vain = 0
    while len(run.fit.chosen) < config.most + run.given and vain < config.patience:
        tried, looked = [], []
        if not run.given:
            tried = far_trials(run.problem, run.fit, run.candidates, run.weights, config.far)
            tried = [t for t in tried if t.candidate not in run.closed]
        if not tried:
            tried, looked = run.trials()
        limits = limit_trials(run.problem, run.fit, run.candidates, run.weights)
        tried += [t for t in limits if t.candidate not in run.closed]
        if not tried and not looked:
            break
        if not tried:
            run.closed |= set(looked)
            vain += 1
            continue
        best = simplest(tried, run.fit.cost)
        if best.candidate.effect in LIMITS and run.find_loss():
            continue  # a lost command, too, spoils a few windows
        vain += not run.accept(best.candidate, best.values)
