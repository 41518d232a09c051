"""The candidates that explain most when each is taken alone: a first look, no search."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from bumblebee.diagnosis.candidates import Candidate
from bumblebee.diagnosis.comparison import Holdout
from bumblebee.diagnosis.config import SearchConfig
from bumblebee.diagnosis.estimation import Fit
from bumblebee.diagnosis.residuals import Problem
from bumblebee.diagnosis.selection.forward import begin
from bumblebee.diagnosis.selection.moves import Terms, refitted
from bumblebee.diagnosis.selection.state import SearchState
from bumblebee.diagnosis.selection.trial import Trial
from bumblebee.sim.effects import Effect


@dataclass(frozen=True, eq=False)
class Lead:
    """One candidate, fitted alone beside what the search begins with."""

    candidate: Candidate
    values: np.ndarray
    """(P,) parameters."""
    z: float
    """Standard errors from the declared value."""
    explains: float
    """Share of the chi-square above the noise that goes with it, on windows that took no part where there are any."""


def leads(
    problem: Problem,
    holdout: Holdout,
    remake: Callable[[Sequence[Effect]], tuple[list[Candidate], np.ndarray]],
    config: SearchConfig,
    say: Callable[[str], None],
    count: int,
) -> tuple[list[Lead], float]:
    """The `count` candidates whose trials cost least, the best first; and the z that each had to reach.

    An effect in one place is one lead, by the candidate whose trial costs least, however many of its parameters are
    tested together.
    """
    run = begin(problem, holdout, remake, config, say)
    tried, _ = run.trials()
    found = []
    cheapest: dict[tuple[str, str], Trial] = {}
    for trial in sorted(tried, key=lambda t: t.cost):
        cheapest.setdefault((trial.candidate.effect, trial.candidate.where), trial)
    for trial in list(cheapest.values())[:count]:
        start = np.concatenate((run.fit.values, trial.values))
        move = refitted(run.now, run.fit, trial.candidate, [start], Terms(run.bound, (), iterations=2))
        if move is not None:
            found.append(Lead(trial.candidate, move.after.of(trial.candidate), move.z, _explains(run, move.after)))
    return sorted(found, key=lambda lead: -lead.explains), run.bound


def _explains(run: SearchState, after: Fit) -> float:
    """Share of the mean square above 1 that goes from the state's fit to another; by the median of the windows."""
    judged = run.holdout.problem is not None
    old, new = run.holdout.left([run.fit, after]) if judged else (f.clean(run.problem) for f in (run.fit, after))
    power = [float(np.median((r**2).mean(axis=1))) for r in (old, new)]
    return float(np.clip((power[0] - power[1]) / max(power[0] - 1.0, 1e-12), 0.0, 1.0))
