"""Two fits on the same windows, window by window: is the second better, or at least no worse?

The last question: is the corrected model worse than the declared one on windows that took no part in the fit?

Each effect had to pay there when it was accepted, but not all of what stands in the end is judged so: steps of encoders
are read off the logs, a last fit moves every value. A correction that makes things worse is withdrawn, with a note.
"""

from collections.abc import Sequence

import numpy as np
from scipy.stats import norm, wilcoxon
from scipy.stats import t as student

from bumblebee.diagnosis.comparison.holdout import Holdout
from bumblebee.diagnosis.comparison.information_criterion import criterion, parameters
from bumblebee.diagnosis.comparison.submodel import less
from bumblebee.diagnosis.estimation import Fit, cost_of
from bumblebee.diagnosis.residuals import Problem, window_weights
from bumblebee.sim.effects import Effect

_SURER = 3.0  # standard errors, where windows count to which the fits have bent
_MANY_FEWER = 2  # numbers saved, from which on a better fit of all windows need not be beyond doubt
_FELT, _NEARLY, _CLEAR = 0.1, 0.8, 0.5  # change of a window's log(1 + power); share of these that gain; their sum
_SEVERAL, _MOSTLY = 4, 0.5  # windows that speak for themselves; share of the excess that fewer must lose
_UNFELT = 0.1  # of what a fitted window feels, on the mean: a window that feels less cannot judge
MUCH = 0.1  # fall of log(1 + chi-square)
_CONFIRMED = 2.0  # standard errors by which windows that were not fitted must be better
_WORSE = 0.02  # growth of log(1 + chi-square) that is none


def no_worse_within_errors(problem: Problem, holdout: Holdout, before: Fit, swapped: Fit) -> bool:
    """Whether the fit with a rival in an effect's place is not worse beyond two standard errors, or even better."""
    if swapped.cost < before.cost:
        return True
    if holdout.problem is not None:
        logs = holdout.logs([before, swapped])
    else:
        raw = problem.residual([before.effects, swapped.effects])
        left = raw - np.tensordot(before.nuisance, problem.nuisance, axes=1)
        logs = np.log1p((left**2).mean(axis=2))
    loss = logs[1] - logs[0]
    return bool(loss.mean() < 2.0 * loss.std(ddof=1) / np.sqrt(len(loss)))


def no_worse_by_mean(holdout: Holdout, before: Fit, after: Fit) -> bool:
    """Whether the judging windows are no further off, in the mean of log(1 + chi-square), and not later either."""
    if holdout.problem is None:
        return True
    old, new = holdout.logs([before, after])
    return bool(new.mean() <= old.mean()) and not holdout.worse_later(before, after)


def lead(problem: Problem, holdout: Holdout, form: Fit, named: Fit) -> float:
    """Share of what a form gains that names do not; 0 unless the form is better window by window beyond doubt.

    Judged on windows that took no part in the fits, on the fitted ones where there are none: by the fall of
    log(1 + chi-square) from the fit of what both have. Names that need more numbers than the form must be the better
    ones, for enough of them come near anything.
    """
    common = less(problem, form, [c for c in form.chosen if c not in named.chosen])
    left = _logs(problem, holdout, [common, named, form])
    gain, whole = left[1] - left[2], left[0] - left[2]
    error = 0.0 if parameters(named) > parameters(form) else _doubt(gain)
    return float(gain.mean() / max(whole.mean(), gain.mean())) if gain.mean() > error else 0.0


def is_better(problem: Problem, holdout: Holdout, before: Fit, after: Fit) -> bool:
    """Whether `after`, with no more numbers than `before`, is better window by window beyond doubt, and later no worse.

    By two standard errors on the windows that judge. With fewer numbers, which fitted windows flatter less, three on
    those and the fitted ones together do as well, if the ones that judge are no worse. With two fewer or more, a better
    fit of both will do: several names that are near a law need not be far from it.
    """
    fewer = parameters(before) - parameters(after)
    if fewer < 0 or criterion(problem, after) <= criterion(problem, before):
        return False
    left = _logs(problem, holdout, [before, after])
    gain = left[0] - left[1]
    sure = gain.mean() > _doubt(gain)
    if fewer and not sure and gain.mean() > 0 and holdout.problem is not None:
        fitted = np.subtract(*_logs(problem, Holdout(), [before, after]))
        gain = np.concatenate((gain, fitted))
        sure = gain.mean() > _doubt(gain, _SURER) or (fewer >= _MANY_FEWER and fitted.mean() > 0)
    return bool(sure) and not holdout.worse_later(before, after)


def _doubt(gain: np.ndarray, count: float = 2.0) -> float:
    """So many standard errors of the mean of (W,) differences between windows, wider where these are few."""
    return float(student.ppf(norm.cdf(count), len(gain) - 1) * gain.std(ddof=1) / np.sqrt(len(gain)))


def _logs(problem: Problem, holdout: Holdout, fits: Sequence[Fit]) -> np.ndarray:
    """log(1 + chi-square) (F, W) of the windows that judge."""
    if holdout.problem is not None:
        return holdout.logs(fits)
    return np.stack([np.log1p((f.clean(problem) ** 2).mean(axis=1)) for f in fits])


def plausible(clean: np.ndarray, change: np.ndarray) -> bool:
    """Whether a change (W, M) that few windows feel takes nearly all of their excess of log(1 + power) over noise."""
    before, after = (np.log1p((x**2).mean(axis=1)) for x in (clean, clean - change))
    felt = np.abs(before - after) > _FELT
    excess = np.maximum(before[felt] - np.log(2.0), 0.0).sum()
    return felt.sum() >= _SEVERAL or float((before - after)[felt].sum()) > _MOSTLY * excess


def pays_where_felt(problem: Problem, holdout: Holdout, before: Fit, after: Fit, least: int = 1) -> bool:
    """Whether `after` is better on nearly all windows that the two fits predict differently, held-out ones included.

    The rest of the windows, most of them, knows nothing of a limit: a mean gain over all of them would need many more
    windows that feel it than a limit reaches. `least` is how many windows must be better.
    """
    sides = [(before.clean(problem), after.clean(problem)), *_judged(holdout, before, after)]
    gains = np.concatenate([np.log1p((old**2).mean(axis=1)) - np.log1p((new**2).mean(axis=1)) for old, new in sides])
    felt = gains[np.abs(gains) > _FELT]
    better = int((felt > 0).sum())
    return better >= max(least, 1) and better >= _NEARLY * len(felt) and float(felt.sum()) > _CLEAR


def pays_where_rare(problem: Problem, holdout: Holdout, before: Fit, after: Fit) -> bool:
    """The same for any effect that the held-out windows cannot judge: they feel next to nothing of it.

    Fitted windows alone decide then, each for itself, and several must.
    """
    change = ((before.clean(problem) - after.clean(problem)) ** 2).sum(axis=1).mean()
    seen = [((old - new) ** 2).sum(axis=1).mean() for old, new in _judged(holdout, before, after)]
    if not seen or seen[0] > _UNFELT * change:
        return False
    return pays_where_felt(problem, holdout, before, after, _SEVERAL)


def _judged(holdout: Holdout, before: Fit, after: Fit) -> list[tuple[np.ndarray, np.ndarray]]:
    """Held-out residuals (W, M) of the two fits less their nuisances; empty where nothing is held out."""
    if holdout.problem is None:
        return []
    old, new = holdout.left([before, after])
    return [(old, new)]


def pays_together(problem: Problem, holdout: Holdout, before: Fit, after: Fit) -> bool:
    """Whether windows that took no part are better with `after` than with `before`, which lacks some of it, by far.

    Not worse after 1 s either. Without such windows those of `problem`, the fitted ones, decide.
    """
    if holdout.problem is None:
        weights = window_weights(after.clean(problem))
        old, new = (cost_of(problem, fit.residual, weights)[0] for fit in (before, after))
        return new < (1.0 - MUCH) * old
    gain = np.subtract(*holdout.logs([before, after]))
    doubt = 2.0 * gain.std() / np.sqrt(len(gain))
    return bool(gain.mean() > max(MUCH, doubt)) and not holdout.worse_later(before, after)


def better(before: np.ndarray, after: np.ndarray) -> bool:
    """Whether windows (W, M) are better `after`: log(1 + chi-square) falls beyond doubt by its mean or by ranks."""
    gain = np.log1p((before**2).mean(axis=1)) - np.log1p((after**2).mean(axis=1))
    if gain.mean() <= 0:
        return False
    spread = gain.std(ddof=1) / np.sqrt(len(gain)) + 1e-30
    ranks = wilcoxon(gain, alternative="greater").pvalue if len(gain) > 8 else 1.0
    return bool(gain.mean() > _CONFIRMED * spread or ranks < norm.sf(_CONFIRMED))


def is_worse_than(problem: Problem, before: Sequence[Effect], after: Sequence[Effect]) -> bool:
    """Whether the windows of `problem` are further off with `after`, beyond two standard errors and a trifle.

    Each with numerical differences of its own taken out.
    """
    logs = []
    for residual in problem.residual([before, after]):
        nuisance = cost_of(problem, residual, window_weights(residual))[1]
        left = residual - np.tensordot(nuisance, problem.nuisance, axes=1)
        logs.append(np.log1p((left**2).mean(axis=1)))
    growth = logs[1] - logs[0]
    error = growth.std(ddof=1) / np.sqrt(len(growth)) if len(growth) > 1 else np.inf
    return bool(growth.mean() > max(_WORSE, 2.0 * error))


def standing(
    problem: Problem, fitted: Sequence[Effect], read: Sequence[Effect]
) -> tuple[list[Effect], list[Effect], list[str]]:
    """What may stand of the effects that were fitted and of those that were read off the logs; and notes on the rest.

    `problem` has windows that took no part in the fit, where there are any.
    """
    fitted, read, notes = list(fitted), list(read), []
    if read and is_worse_than(problem, fitted, [*fitted, *read]):
        notes.append(_note(read))
        read = []
    if fitted and is_worse_than(problem, read, [*fitted, *read]):
        notes.append(_note(fitted))
        fitted = []
    return fitted, read, notes


def _note(effects: Sequence[Effect]) -> str:
    names = ", ".join(f"{e.effect} on {', '.join(e.where) or 'the whole robot'}" for e in effects)
    return f"withdrawn, for the windows that judge were further off with it: {names}"
