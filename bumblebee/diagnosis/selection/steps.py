"""The one place where a search's state changes: steps ask, and here it is done."""

from collections.abc import Callable
from typing import TypeVar

from bumblebee.diagnosis.comparison import certainty, evidence, wald
from bumblebee.diagnosis.residuals import screening_windows, window_weights
from bumblebee.diagnosis.selection.changes import (
    Anew,
    Asked,
    Asking,
    Change,
    Expecting,
    Lost,
    Offered,
    Refitted,
    Renamed,
    Taken,
    Vain,
)
from bumblebee.diagnosis.selection.state import SearchState

T = TypeVar("T")


def go(run: SearchState, step: Callable[[SearchState], Asking[T]]) -> T:
    """Take a step: make each change that it asks for, and return what it returns."""
    asking, other = step(run), None
    try:
        while True:
            try:
                change = next(asking) if other is None else asking.send(other)
            except StopIteration as end:
                return end.value
            other = _made(run, change)
    finally:
        run.expected = 0


def _made(run: SearchState, change: Change) -> bool:
    """Make a change; whether the model is another one now."""
    match change:
        case Offered():
            return run.accept(change.candidate, change.values)
        case Taken():
            run.take(change.move, change.rivals)
            if change.reopens:
                run.closed.clear()
        case Refitted():
            run.say(change.said)
            run.renew(change.fit)
            if change.pruned:
                run.prune()
        case Renamed():
            _rename(run, change)
        case Anew():
            _begin_anew(run, change)
        case Lost():
            _lose(run, change)
        case Expecting():
            run.expected = change.effects
            return False
        case Vain():
            run.hopeless.add((change.effect, change.where))
            return False
        case Asked():
            run.asked_far, run.tried_many = run.asked_far or change.far, run.tried_many or not change.far
            return False
    return True


def _rename(run: SearchState, change: Renamed) -> None:
    """With evidence for the names that are new."""
    run.fit = change.fit
    for i, c in enumerate(run.fit.chosen):
        if c not in {s.candidate for s in run.steps}:
            z = wald(run.problem, run.fit, run.weights, i)
            run.steps.append(evidence(c, z, len(run.candidates)))


def _begin_anew(run: SearchState, change: Anew) -> None:
    """Go on from other windows; what was tried in vain may be tried again, many effects at once may not."""
    run.problem, run.holdout, run.fit = change.problem, change.holdout, change.fit
    run.keep = screening_windows(run.problem, run.config.screen_windows)
    run.weights = window_weights(run.fit.clean(run.problem))
    run.whitened_at = run.power()
    run.closed.clear()
    run.hopeless.clear()
    run.rescreen()
    if not change.begun:
        run.say(f"whitened again around the effects found: chi-square {run.power():.3g}")
        return
    z = certainty(run.problem, run.fit, run.weights)
    run.steps = [evidence(c, float(least), len(run.candidates)) for c, least in zip(run.fit.chosen, z, strict=True)]
    run.say(f"restarting the search from {len(run.fit.chosen)} jointly fitted effects: chi-square {run.power():.3g}")
    run.tried_many, run.given = True, len(run.fit.chosen)
    run.patience = min(run.patience, run.rule.many_patience)


def _lose(run: SearchState, change: Lost) -> None:
    loss = change.loss
    run.loss, run.problem, run.holdout, run.fit = loss, change.problem, change.holdout, change.fit
    run.say(f"found lost commands on {loss.where or 'the whole robot'}: {loss.share:.4f}")
    run.closed.clear()
    run.hopeless.clear()
    run.renew(run.fit)
    run.rescreen()
