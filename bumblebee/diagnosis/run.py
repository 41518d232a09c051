"""The state of one search: what is chosen, what is left to try, and the moves from one state to the next."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from bumblebee.diagnosis.acceptance import ABRUPT, Step, evidence, is_physical, least_z, pruned, wald
from bumblebee.diagnosis.arrivals import Loss, find_loss
from bumblebee.diagnosis.candidates import Candidate, shortlisted
from bumblebee.diagnosis.changes import Changes
from bumblebee.diagnosis.eligible import is_chosen, is_like, is_promising
from bumblebee.diagnosis.far import far_servos
from bumblebee.diagnosis.fit import Fit, cost_of, effects_at, gauss_newton, resolved, typical_power
from bumblebee.diagnosis.gains import plain_gains
from bumblebee.diagnosis.holdout import Holdout
from bumblebee.diagnosis.limits import KINDS as LIMITS
from bumblebee.diagnosis.limits import pays_where_felt, pays_where_rare
from bumblebee.diagnosis.many import anew, certainty, fit_many, pays_together
from bumblebee.diagnosis.problem import Problem, window_weights
from bumblebee.diagnosis.scores import Columns, Scores, score_tests
from bumblebee.diagnosis.screen import Answered, pulse_sizes, restless, screen, screening_windows
from bumblebee.diagnosis.search_config import SearchConfig
from bumblebee.diagnosis.stages import Stages
from bumblebee.diagnosis.trials import Trial, try_one
from bumblebee.sim.effects import Effect

_ANEW = 0.1  # share of the cost left, below which all candidates are screened anew
_SOME = 2  # effects after which a model that is still far off is taken to lack many
_LITTLE = 0.5  # share of the median chi-square that the last of them took at most
_PATIENCE = 2  # rounds that may fail once many were fitted together
_FAINT = 0.15  # share of the best candidate's gain, below which another can wait for a later round
_CHANGED = 0.8  # share of the cost that a fit must leave less of, to be worth linearising around


class Run:
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
        self.hopeless: set[tuple[str, str]] = set()  # limits, plays, shafts (effect, joint) that were tried in vain
        self.changes, self.stages = Changes(), Stages(problem, self.keep)
        self.answers: Answered | None = None
        self.steps: list[Step] = []
        self.rejected: list[str] = []
        self.loss: Loss | None = None
        self.given = 0
        self.tried_many, self.patience = False, config.patience
        self.fall = 1.0
        self.candidates, _ = remake([])
        self.start_far()
        self.rescreen()
        self.bound = least_z(self.small, self.columns, self.small_fit(), len(self.candidates), config.level)

    def rescreen(self) -> None:
        """Candidates with steps for the present fit, and the columns of all of them around it."""
        self.small = self.problem.part(self.keep)
        self.candidates, torque = self.remake(self.fit.effects)
        known = None if self.answers is None else self.answers.on(self.problem)
        sizes = pulse_sizes(self.problem, torque)
        self.columns, white = screen(self.small, self.candidates, self.fit.effects, sizes, known)
        self.answers = Answered(self.fit.effects, white, (self.problem.windows, self.problem.whitener))
        self.screened_cost = self.fit.cost

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
        sure, least = 2.0 * max(self.fit.cost / self.fit.residual.size, 1.0) * (share * self.bound) ** 2, 0.0
        for k in np.argsort(-tests.gain):
            c = self.columns.candidates[k]
            if len(found) >= self.config.simulated or tests.gain[k] <= least:
                break
            if self.is_open(c, tests, k, 0.7 * share * self.bound, share**2) and not is_like(c, found):
                found.append(c)
                if tests.gain[k] > sure and tests.z[k] > self.bound:
                    least = max(least, _FAINT * tests.gain[k])
        left = self.small_fit().clean(self.small)
        poor = restless(self.small, self.answers.white, left, self.config.shortlist)
        joints = len(self.problem.plant.joints)
        listed = [c for c in self.candidates if c.where in poor and shortlisted(c, joints)]
        listed = [c for c in listed if c not in self.closed and not is_chosen(c, self.fit.chosen)]
        return found + self.seen(listed, 0.7 * share * self.bound, share**2)

    def seen(self, listed: Sequence[Candidate], bound: float, share: float) -> list[Candidate]:
        """Those of some candidates without screening columns that the screening windows, too, make worth a trial."""
        if not listed:
            return []
        columns = Columns(listed, self.small.sensitivities(listed, self.fit.effects))
        tests = score_tests(self.small, columns, self.small_fit(), self.weights[self.keep])
        return [c for k, c in enumerate(listed) if self.is_open(c, tests, k, bound, share)]

    def is_open(self, c: Candidate, tests: Scores, k: int, bound: float, share: float) -> bool:
        """Whether a candidate, number `k` of `tests`, is worth a trial and was not chosen or tried in vain."""
        if c in self.closed or is_chosen(c, self.fit.chosen):
            return False
        if c.effect in LIMITS and tests.z[k] < bound:  # those that few windows feel have trials of their own
            return False
        return is_promising(c, tests, k, bound, share, self.fit.cost, self.fit.cost / self.fit.residual.size)

    def trials(self) -> tuple[list[Trial], list[Candidate]]:
        """Candidates tried in the simulator with their costs; and those that were looked at."""
        looked = self.promising()
        if not looked:
            return [], []
        self.say(f"{len(looked)} of {len(self.candidates)} candidates simulated on all windows")
        left = self.left_over(looked)
        if not left:
            return [], looked
        tests = score_tests(self.problem, self.sensitivities(left), self.fit, self.weights)
        order = [k for k in np.argsort(-tests.gain) if self.is_open(left[k], tests, k, self.bound, 1.0)]
        joints, best = len(self.problem.plant.joints), max((tests.gain[k] for k in order), default=0.0)
        faint = [k for k in order if tests.gain[k] < _FAINT * best and not shortlisted(left[k], joints)]
        wait, order = [left[k] for k in faint], [k for k in order if k not in faint][: self.config.trials]
        tried = [try_one(self.problem, self.fit, left[k], tests.steps[k], self.weights) for k in order]
        tried = [t for t in tried if t is not None and t.cost < self.fit.cost - self.bound**2 / 2]
        return tried, [c for c in looked if c not in wait]

    def left_over(self, looked: Sequence[Candidate]) -> list[Candidate]:
        """Those of some candidates that as many windows as were screened do not speak against."""
        self.stages = self.stages.on(self.problem, self.keep)
        known, tests = self.stages.tests(self.problem, self.columns, looked, self.fit, self.weights)
        share = len(self.stages.both) / len(self.problem.windows)
        least = 0.7 * np.sqrt(share) * self.bound
        gone = [c for k, c in enumerate(known) if not self.is_open(c, tests, k, least, share)]
        return [c for c in looked if c not in gone]

    def sensitivities(self, looked: Sequence[Candidate]) -> Columns:
        """Columns of some candidates on all windows; of those near which nothing has changed, as they were."""
        self.stages = self.stages.on(self.problem, self.keep)
        every = [self.stages.columns(self.problem, c, self.fit.effects) for c in looked]
        return Columns(looked, np.concatenate(every))

    def accept(self, candidate: Candidate, values: np.ndarray) -> bool:
        """Refit with the candidate; keep it if the joint fit and the held-out windows agree."""
        chosen, start = (*self.fit.chosen, candidate), np.concatenate((self.fit.values, values))
        # Windows that only this effect explains weighed little so far: weigh them as it leaves them.
        residual = self.problem.residual([effects_at(chosen, start)])[0]
        weights = window_weights(residual - np.tensordot(self.fit.nuisance, self.problem.nuisance, axes=1))
        fit = gauss_newton(self.problem, chosen, start, weights, iterations=2, coarse=True, known=self.fit)
        z = wald(self.problem, fit, weights, len(fit.chosen) - 1)
        if z < self.bound:  # the windows that judge need not be simulated
            return self.refuse(candidate)
        pays = self.holdout.gains(self.fit, fit, self.config.holdout_z, self.config.least_gain) or (
            pays_where_felt(self.problem, self.holdout, self.fit, fit)
            if candidate.effect in (*LIMITS, *ABRUPT)
            else pays_where_rare(self.problem, self.holdout, self.fit, fit)
        )
        if not pays or not is_physical(self.problem, self.fit, fit, candidate, weights):
            return self.refuse(candidate)
        self.steps.append(evidence(candidate, z, len(self.candidates)))
        self.say(f"found {candidate.effect} on {candidate.where or 'the whole robot'}: {fit.of(candidate).round(5)}")
        before = self.power()
        self.renew(fit)
        self.fall = 1.0 - self.power() / max(before, 1e-12)
        return True

    def power(self) -> float:
        """Median chi-square of the windows, by value."""
        return self.fit.power(self.problem)

    def refuse(self, candidate: Candidate) -> bool:
        """Leave a candidate out of all further trials; always False."""
        self.closed.add(candidate)
        self.rejected.append(f"{candidate.effect} on {candidate.where or 'the whole robot'}")
        return False

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
        if typical_power(self.fit.residual) < self.config.far:
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
            self.steps.append(evidence(c, z, len(self.candidates)))
            self.say(f"found {c.effect} on {c.where}, far from the declared: {fit.of(c).round(5)}")
        self.screened_cost = 0.0
        self.renew(fit)
        self.given = len(fit.chosen)
        return True

    def start_many(self) -> bool:
        """Begin anew with the usual effects of all joints, where some effects leave the data far from the model.

        Only if the last of these explained little, or they are very far: else the next may explain the rest.
        """
        if self.tried_many or self.given or len(self.fit.chosen) < _SOME or self.power() < self.config.many:
            return False
        if self.fall >= _LITTLE and self.power() < self.config.far:
            return False
        self.tried_many = True
        fit = fit_many(self.problem, self.candidates, self.fit, self.say)
        if fit is None or not pays_together(self.problem, self.holdout, self.fit, fit):
            return False
        self.problem, self.holdout, fit = anew(self.problem, self.holdout, fit)
        self.keep = screening_windows(self.problem, self.config.screen_windows)
        weights = window_weights(fit.clean(self.problem))
        z = certainty(self.problem, fit, weights)
        self.steps = [evidence(c, float(least), len(self.candidates)) for c, least in zip(fit.chosen, z, strict=True)]
        self.say(f"begun anew with {len(fit.chosen)} effects together: chi-square {fit.power(self.problem):.3g}")
        self.closed.clear()
        self.hopeless.clear()
        self.given, self.patience = len(fit.chosen), min(self.patience, _PATIENCE)
        self.weights, self.fit = weights, fit
        self.rescreen()
        return True

    def find_loss(self) -> bool:
        """Look for commands that never arrived; if some did not, go on with those that did."""
        found = None if self.loss else find_loss(self.problem, self.holdout, self.fit)
        if found is None:
            return False
        self.loss, self.problem, self.holdout = found
        self.say(f"found lost commands on {self.loss.where or 'the whole robot'}: {self.loss.share:.4f}")
        self.closed.clear()
        self.hopeless.clear()
        chosen, values = self.fit.chosen, self.fit.values
        self.fit = gauss_newton(self.problem, chosen, values, self.weights, iterations=2, coarse=True)
        self.renew(self.fit)
        self.rescreen()
        return True

    def prune(self) -> None:
        """Drop effects that the others have made needless."""

        def refit(chosen: Sequence[Candidate], values: np.ndarray) -> Fit:
            return gauss_newton(self.problem, chosen, values, self.weights, iterations=2, coarse=True, known=self.fit)

        self.fit = pruned(self.problem, self.fit, self.weights, self.bound, refit, self.holdout, self.say)

    def plain(self) -> None:
        """Effects on a servo's gains in their plainest form, with evidence for those that are new."""
        if self.given:  # kp and kd apart from the start on
            return
        self.fit = plain_gains(self.problem, self.fit, self.candidates, self.weights, self.bound, self.say)
        for i, c in enumerate(self.fit.chosen):
            if c not in {s.candidate for s in self.steps}:
                z = wald(self.problem, self.fit, self.weights, i)
                self.steps.append(evidence(c, z, len(self.candidates)))
