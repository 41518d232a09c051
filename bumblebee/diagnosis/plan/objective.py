"""How much a plan is worth: classes told apart, intervals made narrower, by information that is expected."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from bumblebee.diagnosis.plan.basis import Basis
from bumblebee.diagnosis.thresholds.plan import Choice, PlanThresholds


@dataclass(frozen=True, eq=False)
class Question:
    """If one effect is there and another is fitted in its place: how large is what is left?"""

    group: str
    """The class that it belongs to."""
    true: int
    """Candidate that is there."""
    fitted: int
    """Candidate that is fitted."""
    rows: np.ndarray
    """Rows of the parameters that are there."""
    size: np.ndarray
    """(F,) steps of its rows."""
    others: np.ndarray
    """Rows that are free in the fit: nuisances, what else was found, the candidate that is fitted."""


@dataclass(frozen=True, eq=False)
class Objective:
    """Objective of total information (N, N): of the data there are and of the runs chosen."""

    basis: Basis
    first: int
    """Rows of nuisances, before the basis's."""
    questions: Sequence[Question]
    prior: np.ndarray
    """(N,) information before any data: of nuisances 1, of an effect next to none."""
    blocks: Sequence[np.ndarray]
    """Rows of the usual effects that are fitted together: of a joint and its body; nuisances first."""
    rule: Choice = field(default_factory=Choice)

    def rows(self, k: int) -> np.ndarray:
        """Rows of a candidate."""
        span = self.basis.slices[k]
        return self.first + np.arange(span.start, span.stop)

    @property
    def nuisances(self) -> np.ndarray:
        """Rows of the nuisances."""
        return np.arange(self.first)

    def left(self, total: np.ndarray, question: Question) -> tuple[float, float]:
        """Chi-square that is left of what is there, with the rival fitted, and without it."""
        own, z = question.rows, question.others
        alone = self._left(total, own, question.size, z[~np.isin(z, self.rows(question.fitted))])
        return self._left(total, own, question.size, z), alone

    def _left(self, total: np.ndarray, rows: np.ndarray, size: np.ndarray, others: np.ndarray) -> float:
        normal = total[np.ix_(others, others)] + np.diag(self.prior[others])
        cross = total[np.ix_(others, rows)] @ size
        whole = float(size @ total[np.ix_(rows, rows)] @ size)
        return max(whole - float(cross @ np.linalg.solve(normal, cross)), 0.0)

    def widths(self, total: np.ndarray) -> dict[int, np.ndarray]:
        """Standard errors (F,) of the found effects in steps, fitted together."""
        found = list(self.basis.found)
        if not found:
            return {}
        rows = np.concatenate([self.nuisances, *(self.rows(k) for k in found)])
        errors, at, out = self._errors(total, rows), self.first, {}
        for k in found:
            count = len(self.rows(k))
            out[k], at = errors[at : at + count], at + count
        return out

    def usual_widths(self, total: np.ndarray) -> np.ndarray:
        """Standard errors, in steps, of all usual effects, each fitted with those of its joint."""
        if not self.blocks:
            return np.ones(1)
        return np.concatenate([self._errors(total, rows)[self.first :] for rows in self.blocks])

    def _errors(self, total: np.ndarray, rows: np.ndarray) -> np.ndarray:
        inverse = np.linalg.inv(total[np.ix_(rows, rows)] + np.diag(self.prior[rows]))
        return np.sqrt(np.maximum(np.diag(inverse), 1e-30))

    def resolved(self, total: np.ndarray) -> dict[str, float]:
        """Class -> how far it is told apart: the mean over its questions, 1 where each is answered."""
        scores: dict[str, list[float]] = {}
        for question in self.questions:
            scores.setdefault(question.group, []).append(self.answered(*self.left(total, question)))
        return {group: float(np.mean(values)) for group, values in scores.items()}

    def answered(self, left: float, alone: float) -> float:
        """How far a question is answered: by the chi-square that is left, and by its share of that without the rival.

        1 where `enough` is left and it is as large a share as the largest allowed cosine leaves.
        """
        if alone <= 0.0:
            return 0.0
        seen = min(1.0, float(np.log1p(left) / np.log1p(self.rule.enough)))
        share = min(1.0, left / alone / (1.0 - self.rule.cosine**2))
        return seen * float(np.sqrt(share))

    def value(self, total: np.ndarray) -> float:
        """Value that is maximised: halvings of widths and classes, weighed."""
        classes = sum(self.resolved(total).values())
        widths = [np.log2(w).mean() for w in self.widths(total).values()]
        narrow = -float(np.mean(widths)) if widths else 0.0
        usual = -float(np.log2(self.usual_widths(total)).mean())
        return self.rule.classes * classes + self.rule.intervals * narrow + self.rule.usual * usual


def objective_of(
    basis: Basis, first: int, data: np.ndarray | None, plant_bodies: dict[str, str], rules: PlanThresholds
) -> Objective:
    """The objective over a basis.

    Args:
        basis: the effects.
        first: nuisances.
        data: information (N, N) that there is, None for none.
        plant_bodies: joint -> the body that it moves.
        rules: what is weighed, and by how much.
    """
    prior = np.full(first + basis.slices[-1].stop, 1.0 / rules.information.prior**2)
    prior[:first] = 1.0
    empty = Objective(basis, first, (), prior, (), rules.choice)
    blocks = _blocks(empty, plant_bodies)
    questions = _of_classes(empty, data) if data is not None else []
    if not any(f.equivalent for f in basis.found.values()):
        questions += _of_usual(empty, plant_bodies, rules.information.confused)
    return Objective(basis, first, questions, prior, blocks, rules.choice)


def imitations(objective: Objective, data: np.ndarray) -> dict[tuple[int, int], np.ndarray]:
    """(found, rival) -> steps (F,) at which the rival imitates the found effect on the data, best shape alone."""
    basis, out = objective.basis, {}
    for k, finding in basis.found.items():
        for effect, where in finding.equivalent:
            tried = []
            for other in basis.index(effect, where):
                if other == k:
                    continue
                steps, left = _imitated(objective, data, k, other)
                tried.append((left, other, steps))
            if tried:
                _, other, steps = min(tried, key=lambda t: (t[0], t[1]))
                out[k, other] = steps
    return out


def _imitated(objective: Objective, data: np.ndarray, k: int, other: int) -> tuple[np.ndarray, float]:
    """Steps (F,) of `other` nearest to candidate `k` on the data, nuisances free, and what is left."""
    own, rows, size = objective.rows(k), objective.rows(other), objective.basis.sizes[k]
    z = np.concatenate((objective.nuisances, rows))
    normal = data[np.ix_(z, z)] + np.diag(objective.prior[z])
    cross = data[np.ix_(z, own)] @ size
    fit = np.linalg.solve(normal, cross)
    return fit[objective.first :], float(size @ data[np.ix_(own, own)] @ size - cross @ fit)


def _of_classes(objective: Objective, data: np.ndarray) -> list[Question]:
    """Every ordered pair of each class that the data leave open, the other found effects free in the fit."""
    basis, out = objective.basis, []
    like = imitations(objective, data)
    for k, finding in basis.found.items():
        members = {k: basis.sizes[k]} | {other: steps for (found, other), steps in like.items() if found == k}
        beside = [objective.rows(o) for o in basis.found if o not in members]
        for a, size in members.items():
            for b in members:
                if a != b:
                    others = np.concatenate([objective.nuisances, *beside, objective.rows(b)])
                    out.append(Question(finding.name, a, b, objective.rows(a), size, others))
    return out


def _of_usual(objective: Objective, bodies: dict[str, str], pairs: Sequence[tuple[str, str]]) -> list[Question]:
    """The usual confusions on each joint, both ways, each effect at the size of a first step."""
    basis, out = objective.basis, []

    def on(effect: str, joint: str) -> int | None:
        return next(iter(basis.index(effect, joint) or basis.index(effect, bodies.get(joint, ""))), None)

    for joint in bodies:
        for one, other in pairs:
            a, b = on(one, joint), on(other, joint)
            if a is None or b is None:
                continue
            for true, fitted in ((a, b), (b, a)):
                others = np.concatenate((objective.nuisances, objective.rows(fitted)))
                size = np.ones(len(objective.rows(true)))
                out.append(Question(joint, true, fitted, objective.rows(true), size, others))
    return out


def _blocks(objective: Objective, bodies: dict[str, str]) -> list[np.ndarray]:
    basis, out = objective.basis, []
    for joint, body in bodies.items():
        some = [k for k in basis.usual if basis.candidates[k].where in (joint, body)]
        if some:
            out.append(np.concatenate([objective.nuisances, *(objective.rows(k) for k in some)]))
    return out
