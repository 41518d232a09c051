"""Effects that the others make needless go, of many effects by the slopes that there are."""

from dataclasses import replace

import pytest

from bumblebee.diagnosis.estimation.gauss_newton import gauss_newton
from bumblebee.diagnosis.selection import state
from bumblebee.diagnosis.selection.state import SearchState
from tests.diagnosis.selection.begun import begun

TRUTH = {("coulomb_friction", "j2"): 0.6, ("coulomb_friction", "j3"): 0.4}
NEEDLESS = (("armature", "j1"), ("viscous_friction", "j1"))


def _pruned(monkeypatch: pytest.MonkeyPatch, many: int) -> tuple[SearchState, list[bool]]:
    """The search after it has been pruned, and of each refit whether its slopes were held."""
    run = begun(TRUTH)
    selection = run.problem.thresholds.selection
    rules = replace(selection, final_fit=replace(selection.final_fit, many=many))
    run.problem, run.bound = replace(run.problem, thresholds=replace(run.problem.thresholds, selection=rules)), 4.0
    chosen = [next(c for c in run.candidates if (c.effect, c.where) == name) for name in (*TRUTH, *NEEDLESS)]
    values = [0.6, 0.4, *(c.nominal[0] + 0.3 * c.step[0] for c in chosen[2:])]
    run.fit = gauss_newton(run.problem, chosen, values, run.weights, iterations=0, coarse=True)
    made: list[bool] = []
    real = gauss_newton
    monkeypatch.setattr(
        state, "gauss_newton", lambda *a, **k: ("held" in k and made.append(bool(k["held"]))) or real(*a, **k)
    )
    run.prune()
    return run, made


def test_what_is_needless_goes_by_refits_and_by_slopes_alike(monkeypatch: pytest.MonkeyPatch) -> None:
    run, made = _pruned(monkeypatch, many=30)
    assert [(c.effect, c.where) for c in run.fit.chosen] == list(TRUTH)
    assert made == [False, False]
    other, made = _pruned(monkeypatch, many=3)
    assert [(c.effect, c.where) for c in other.fit.chosen] == list(TRUTH)
    assert made == [True, True, False]  # at last by slopes of its own
    assert other.fit.values == pytest.approx(run.fit.values, rel=0.02)
    assert other.fit.cost == pytest.approx(run.fit.cost, rel=1e-3)
