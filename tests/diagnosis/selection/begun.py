"""A search at its beginning, on rollouts of the arm."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, TypeVar

import numpy as np

from bumblebee.diagnosis.candidates import all_candidates
from bumblebee.diagnosis.comparison import Holdout
from bumblebee.diagnosis.config import SearchConfig
from bumblebee.diagnosis.estimation import Fit
from bumblebee.diagnosis.residuals import Problem
from bumblebee.diagnosis.selection.changes import Asking, Change
from bumblebee.diagnosis.selection.state import SearchState
from tests.diagnosis import arm

T = TypeVar("T")


def begun(truth: dict[tuple[str, str], float], xml: str = arm.XML, windows: int = 15) -> SearchState:
    """With `truth` {(effect, place): value}, declared as `xml`; three rollouts to fit and one to accept by.

    Of the three come `windows`, of the one a third as many.
    """
    session = arm.session_of(arm.simulate(truth, count=4, seconds=6.0), xml)
    problem, other = arm.problem_of(session, [0, 1, 2], windows), arm.problem_of(session, [3], windows // 3)

    def remake(effects: list) -> tuple[list, np.ndarray]:
        return all_candidates(session.plant, session.rollouts, effects), np.full(3, 5.0)

    return SearchState(problem, Holdout(other), remake, SearchConfig(), lambda text: None)


def state(problem: Problem, fit: Fit, candidates: list, weights: np.ndarray, **more: Any) -> Any:
    """Part of a search's state that a proposal reads."""
    given = {"problem": problem, "fit": fit, "candidates": candidates, "weights": weights, "hopeless": set()}
    return SimpleNamespace(**given | more)


def answered(step: Asking[T], make: Callable[[Change], object] = lambda change: False) -> tuple[T, list[Change]]:
    """A step's result, and the changes that it asked for; `make` is told each."""
    asked: list[Change] = []
    while True:
        try:
            change = step.send(None if not asked else False)  # type: ignore[arg-type]
        except StopIteration as end:
            return end.value, asked
        asked.append(change)
        make(change)
