"""The state of one search: what is chosen, what is left to try, and the moves from one state to the next."""

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import replace
from typing import Any

import numpy as np

from bumblebee.diagnosis.candidates import ABRUPT, JUDGED_ALONE, SATURATIONS, Candidate, is_chosen, is_like, shortlisted
from bumblebee.diagnosis.comparison import (
    Holdout,
    Step,
    compare,
    drop_insignificant,
    evidence,
)
from bumblebee.diagnosis.config import SearchConfig
from bumblebee.diagnosis.estimation import Fit, cost_of, gauss_newton, resolved
from bumblebee.diagnosis.residuals import Problem, screening_windows, window_weights
from bumblebee.diagnosis.selection.changes import Loss
from bumblebee.diagnosis.selection.moves import Move, Now, Terms, refitted
from bumblebee.diagnosis.selection.proposals.surface_contact import is_still_confirmed
from bumblebee.diagnosis.selection.score_tests import Scores, least_z, score_tests
from bumblebee.diagnosis.selection.screening import Stages, is_promising, restless
from bumblebee.diagnosis.selection.trial import Trial, try_one
from bumblebee.diagnosis.sensitivities import Answered, Columns, pulse_sizes, screen
from bumblebee.diagnosis.simulation import Changes
from bumblebee.diagnosis.thresholds.selection import Forward
from bumblebee.sim.effects import Effect


class SearchState:
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
        found = gauss_newton(problem, (), (), self.weights)
        self.problem = problem.held_to(found.power(problem))
        self.fit = resolved(self.problem, found, self.weights)
        self.keep = screening_windows(problem, config.screen_windows)
        self.closed: set[Candidate] = set()
        self.hopeless: set[tuple[str, str]] = set()  # limits, plays, shafts (effect, joint) that were tried in vain
        self.changes, self.stages = Changes(), Stages(problem, self.keep)
        self.answers: Answered | None = None
        self.steps: list[Step] = []
        self.rejected: list[str] = []
        self.loss: Loss | None = None
        self.given, self.expected = 0, 0
        self._whole: dict[str, Any] = {}
        self.tried_many, self.asked_far, self.patience = False, False, config.patience
        self.fall, self.whitened_at = 1.0, self.power()
        self.candidates, _ = remake([])

    def keep_whole(self) -> None:
        """Remember this state as one that the search can be left in."""
        kept = {name: value for name, value in vars(self).items() if name != "_whole"}
        self._whole = {n: copy(value) if isinstance(value, (set, list)) else value for n, value in kept.items()}

    def go_back(self) -> None:
        """The state that was remembered last."""
        vars(self).update(self._whole)

    def open(self) -> None:
        """Screen all candidates for the first time, and set the z that each must reach."""
        self.rescreen()
        self.bound = least_z(self.small, self.columns, self.small_fit(), len(self.candidates), self.config.level)

    def rescreen(self) -> None:
        """Candidates with steps for the present fit, and the columns of all of them around it."""
        self.small = self.problem.part(self.keep)
        self.candidates, torque = self.remake(self.fit.effects)
        known = None if self.answers is None else self.answers.on(self.problem)
        sizes = pulse_sizes(self.problem, torque)
        self.columns, white = screen(self.small, self.candidates, self.fit.effects, sizes, known)
        self.answers = Answered(self.fit.effects, white, (self.problem.windows, self.problem.whitener))
        self.screened_cost = self.fit.cost

    @property
    def white(self) -> np.ndarray:
        """(W, nv, S, M) whitened answers of the screening windows to pulses; there once the search is open."""
        assert self.answers is not None
        return self.answers.white

    def small_fit(self) -> Fit:
        """The fit on the screening windows."""
        return replace(self.fit, residual=self.fit.residual[self.keep], columns=self.fit.columns[:, self.keep])

    def tests(self) -> Scores:
        """Score tests of all candidates on the screening windows."""
        return score_tests(self.small, self.columns, self.small_fit(), self.weights[self.keep])

    def promising(self) -> list[Candidate]:
        """The best of the screening, and play and shafts of the joints that are worst explained."""
        tests, bound = self.tests(), self.rule.bound_share
        share = np.sqrt(len(self.keep) / len(self.problem.windows))
        found: list[Candidate] = []
        rule = self.rule
        sure, least = rule.sure * max(self.fit.cost / self.fit.residual.size, 1.0) * (share * self.bound) ** 2, 0.0
        for k in np.argsort(-tests.gain):
            c = self.columns.candidates[k]
            if len(found) >= self.config.simulated or tests.gain[k] <= least:
                break
            if self.is_open(c, tests, k, bound * share * self.bound) and not is_like(c, found):
                found.append(c)
                if tests.gain[k] > sure and tests.z[k] > self.bound:
                    least = max(least, rule.faint * tests.gain[k])
        left = self.small_fit().clean(self.small)
        poor = restless(self.small, self.white, left, self.config.shortlist)
        joints = len(self.problem.plant.joints)
        listed = [c for c in self.candidates if c.where in poor and shortlisted(c, joints)]
        listed = [c for c in listed if c not in self.closed and not is_chosen(c, self.fit.chosen)]
        return found + self.seen(listed, bound * share * self.bound)

    def seen(self, listed: Sequence[Candidate], bound: float) -> list[Candidate]:
        """Those of some candidates without screening columns that the screening windows, too, make worth a trial."""
        if not listed:
            return []
        columns = Columns(listed, self.small.sensitivities(listed, self.fit.effects))
        tests = score_tests(self.small, columns, self.small_fit(), self.weights[self.keep])
        return [c for k, c in enumerate(listed) if self.is_open(c, tests, k, bound)]

    def is_open(self, c: Candidate, tests: Scores, k: int, bound: float) -> bool:
        """Whether a candidate, number `k` of `tests`, is worth a trial and was not chosen or tried in vain."""
        if c in self.closed or is_chosen(c, self.fit.chosen):
            return False
        if c.effect in SATURATIONS and tests.z[k] < bound:  # those that few windows feel have trials of their own
            return False
        return is_promising(c, tests, k, bound, self.fit, self.problem.thresholds.selection.screening)

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
        order = [k for k in np.argsort(-tests.gain) if self.is_open(left[k], tests, k, self.bound)]
        joints, best = len(self.problem.plant.joints), max((tests.gain[k] for k in order), default=0.0)
        faint = [k for k in order if tests.gain[k] < self.rule.faint * best and not shortlisted(left[k], joints)]
        wait, order = [left[k] for k in faint], [k for k in order if k not in faint][: self.config.trials]
        every = [try_one(self.problem, self.fit, left[k], tests.steps[k], self.weights) for k in order]
        tried = [t for t in every if t is not None and t.cost < self.fit.cost - self.bound**2 / 2]
        return tried, [c for c in looked if c not in wait]

    def left_over(self, looked: Sequence[Candidate]) -> list[Candidate]:
        """Those of some candidates that as many windows as were screened do not speak against."""
        self.stages = self.stages.on(self.problem, self.keep)
        known, tests = self.stages.tests(self.problem, self.columns, looked, self.fit, self.weights)
        share = np.sqrt(len(self.stages.both) / len(self.problem.windows))
        least = self.rule.bound_share * share * self.bound
        gone = [c for k, c in enumerate(known) if not self.is_open(c, tests, k, least)]
        return [c for c in looked if c not in gone]

    def sensitivities(self, looked: Sequence[Candidate]) -> Columns:
        """Columns of some candidates on all windows; of those near which nothing has changed, as they were."""
        self.stages = self.stages.on(self.problem, self.keep)
        every = [self.stages.columns(self.problem, c, self.fit.effects) for c in looked]
        return Columns(looked, np.concatenate(every))

    @property
    def now(self) -> Now:
        """State that a move starts from and is judged by."""
        return self.problem, self.holdout, self.fit

    def accept(self, candidate: Candidate, values: np.ndarray) -> bool:
        """Refit with the candidate; keep it if the joint fit and the held-out windows agree."""
        rules = self.problem.thresholds.comparison
        few = rules.where_felt if candidate.effect in (*SATURATIONS, *ABRUPT) else rules.where_rare
        alone = candidate.effect in JUDGED_ALONE
        asked = (rules.validation, few, rules.no_worse_on_average) if alone else (rules.validation, few)
        terms = Terms(self.bound, asked, iterations=0 if alone else 2)
        move = refitted(self.now, self.fit, candidate, [np.concatenate((self.fit.values, values))], terms)
        if move is None or not move.passes():  # if not sure the windows that judge need not be simulated
            return self.refuse(candidate)
        before = self.power()
        self.take(move)
        if alone:
            self.refit()
        self.fall = 1.0 - self.power() / max(before, 1e-12)
        return True

    def refit(self) -> None:
        """All effects together, if the validation windows are no further off then."""
        moved = gauss_newton(self.problem, self.fit.chosen, self.fit.values, self.weights, 2, True, known=self.fit)
        rule = self.problem.thresholds.comparison.no_worse_on_average
        if moved.cost < self.fit.cost and compare(self.problem, self.holdout, self.fit, moved).passes(rule):
            self.renew(moved)

    def take(self, move: Move, rivals: int | None = None) -> None:
        """Make a move; its p is shared among the `rivals`, all candidates if None."""
        new = move.new
        self.steps.append(evidence(new, move.z, len(self.candidates) if rivals is None else rivals))
        instead = ", ".join(f"{c.effect} on {c.where or 'the whole robot'}" for c in move.gone)
        place = f"{new.effect} on {new.where or 'the whole robot'}: {move.after.of(new).round(5)}"
        self.say(f"found {place}" + (f", in place of {instead}" if instead else ""))
        self.renew(move.after)

    @property
    def rule(self) -> Forward:
        """The numbers that this state goes by."""
        return self.problem.thresholds.selection.forward

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
        if cost_of(self.problem, fit.residual, self.weights)[0] < self.rule.relinearise * self.fit.cost:
            self.problem = self.problem.relinearised(fit.effects)
            self.holdout = self.holdout.relinearised(fit.effects)
        self.weights = window_weights(fit.clean(self.problem))
        self.problem = self.problem.held_to(fit.power(self.problem))
        self.fit = resolved(self.problem, fit, self.weights)
        self.small = self.problem.part(self.keep)
        if self.fit.cost < self.rule.anew * self.screened_cost:
            self.rescreen()

    def prune(self) -> None:
        """Drop effects that the others have made needless; of many each is asked by the slopes that there are."""
        known, many = self.fit, len(self.fit.chosen) > self.problem.thresholds.selection.final_fit.many

        def refit(chosen: Sequence[Candidate], values: np.ndarray, by_slopes: bool = many) -> Fit:
            held = chosen if by_slopes else ()
            p = self.problem
            return gauss_newton(p, chosen, values, self.weights, iterations=2, coarse=True, known=known, held=held)

        # Without one of its effects a joint may swing away in so few windows that 400 of 1,700 showed none of it.
        wide = self.holdout.widely()
        self.fit = drop_insignificant(self.problem, self.fit, self.weights, self.bound, refit, wide, self.say)
        if many and self.fit.chosen != known.chosen:
            self.fit = refit(self.fit.chosen, self.fit.values, by_slopes=False)
        for c in [c for c in reversed(self.fit.chosen) if c.effect in JUDGED_ALONE]:
            if not is_still_confirmed(self.problem, self.fit, c, wide):
                self.say(f"removed as redundant: {c.effect} on {c.where}")
                rest = self.fit.without([c])
                self.fit = refit(rest.chosen, rest.values)
