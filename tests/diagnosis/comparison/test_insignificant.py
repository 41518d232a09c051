"""Effects that do not pay on the judging windows beside all others are dropped; what is small and real stays."""

from collections.abc import Sequence

import numpy as np

from bumblebee.diagnosis.candidates.candidate import Candidate
from bumblebee.diagnosis.comparison.backward_elimination import drop_unpaid, shares
from bumblebee.diagnosis.comparison.holdout import Holdout
from bumblebee.diagnosis.estimation.fit import Fit
from bumblebee.diagnosis.estimation.gauss_newton import gauss_newton
from tests.diagnosis.discrepancy.test_discover import prepared

POLE = Candidate("coulomb_friction", "pole", (0.0,), (0.02,))
CART = Candidate("coulomb_friction", "cart", (0.0,), (0.5,))
SPRING = Candidate("joint_spring", "pole", (0.0, 0.0), (0.1, 0.02), (0, 1))


def kept(chosen: Sequence[Candidate], friction: tuple[float, float]) -> tuple[list[str], np.ndarray]:
    """Places of what is kept, and the shares of all before."""
    _, problem, judge = prepared(friction=friction)
    weights = np.ones(len(problem.windows))

    def refit(chosen: Sequence[Candidate], values: np.ndarray) -> Fit:
        return gauss_newton(problem, chosen, values, weights)

    fit, holdout = refit(chosen, np.concatenate([c.start for c in chosen])), Holdout(judge)
    left = drop_unpaid(fit, refit, holdout)
    return [f"{c.effect} {c.where}" for c in left.chosen], shares(holdout, fit)


def test_what_the_judging_windows_do_not_feel_is_dropped() -> None:
    names, share = kept((POLE, SPRING), (0.0, 0.05))
    assert names == ["coulomb_friction pole"]
    assert share[0] > 0.9 and share[1] < 0.05


def test_a_small_effect_that_is_real_stays() -> None:
    names, share = kept((POLE, CART), (0.2, 0.2))
    assert names == ["coulomb_friction pole", "coulomb_friction cart"]
    assert share[1] < 0.05


def test_with_nothing_to_judge_by_all_stay() -> None:
    _, problem, _ = prepared()
    fit = gauss_newton(problem, (SPRING,), SPRING.start, np.ones(len(problem.windows)))
    assert drop_unpaid(fit, lambda chosen, values: fit, Holdout()) is fit
