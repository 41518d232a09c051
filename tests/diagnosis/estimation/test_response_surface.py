"""Where the cost is rough, a descent stays in a hollow; the last step finds the parabola under the roughness."""

from types import SimpleNamespace

import numpy as np
import pytest

from bumblebee.diagnosis.candidates.candidate import Candidate
from bumblebee.diagnosis.estimation.covariance import interval
from bumblebee.diagnosis.estimation.gauss_newton import gauss_newton
from bumblebee.diagnosis.estimation.response_surface import last_step
from bumblebee.diagnosis.thresholds import Thresholds
from bumblebee.sim.effects import Effect

FRICTION = 0.27
RUBS = Candidate("coulomb_friction", "j", (0.0,), (0.18,))
W, M = 60, 20


class Rough:
    """A linear model of W windows whose residual jumps in a few of them wherever the friction passes 0.0005 N m."""

    def __init__(self, floating: bool = True, jump: float = 1.0) -> None:
        rng = np.random.default_rng(1)
        self.plant = SimpleNamespace(floating=floating, joints=("j",), bodies=())
        self.windows = SimpleNamespace(rollout=np.arange(W) % 5)
        self.nuisance, self.prior = np.zeros((1, W, M)), 1.0
        self.thresholds = Thresholds()
        self.column = 4.5 * rng.standard_normal((W, M))  # for a change of 0.18 N m
        self.noise = rng.standard_normal((W, M))
        self.jump = jump

    def residual(self, models: list[list[Effect]], coarse: bool = False) -> np.ndarray:
        """(V, W, M) of dry frictions."""
        return np.stack([self._one(effects[0].values()[0] if effects else 0.0) for effects in models])

    def differences(self, effects: list[Effect], moved: list[list[Effect]], coarse: bool) -> np.ndarray:
        """Change of the prediction to others (V, W, M)."""
        return self.residual([effects])[0] - self.residual(moved)

    def _one(self, friction: float) -> np.ndarray:
        out = self.noise - (friction - FRICTION) / 0.18 * self.column
        rng = np.random.default_rng(int(friction / 0.0005))
        some = rng.choice(W, 6, replace=False)
        out[some] += self.jump * rng.standard_normal((6, M))
        return out


STARTS = np.linspace(0.9, 1.1, 11) * FRICTION


def test_descent_stops_in_hollows_and_the_last_step_does_not() -> None:
    problem, ones = Rough(), np.ones(W)
    descent = np.array([gauss_newton(problem, (RUBS,), (v,), ones).values[0] for v in STARTS]) - FRICTION
    level = np.array([last_step(problem, (RUBS,), (v,), ones).values[0] for v in STARTS]) - FRICTION
    half = interval(problem, last_step(problem, (RUBS,), (FRICTION,), ones), ones)[0]
    assert np.abs(level).max() < 1.5 * half
    assert np.sqrt((level**2).mean()) < 0.7 * np.sqrt((descent**2).mean())


def test_of_a_smooth_model_it_is_the_least_squares_fit_from_anywhere() -> None:
    problem, ones = Rough(jump=0.0), np.ones(W)
    best = gauss_newton(problem, (RUBS,), (FRICTION,), ones).values[0]
    for v in STARTS:
        fit = last_step(problem, (RUBS,), (v,), ones)
        assert fit.values[0] == pytest.approx(best, rel=1e-6)
        assert fit.columns == pytest.approx(problem.column[None])


def test_on_a_bound_the_slope_is_one_sided() -> None:
    fit = last_step(Rough(jump=0.0), (RUBS,), (0.0,), np.ones(W))
    assert fit.values[0] == pytest.approx(FRICTION, rel=0.05)


def test_a_fixed_base_is_fitted_as_before() -> None:
    problem, ones = Rough(floating=False), np.ones(W)
    as_before = gauss_newton(problem, (RUBS,), (STARTS[0],), ones, iterations=1)
    assert last_step(problem, (RUBS,), (STARTS[0],), ones).values == pytest.approx(as_before.values)


def test_a_limit_is_fitted_as_before() -> None:
    problem, limit = Rough(), Candidate("torque_limit", "j", (1.0,), (-0.18,))
    as_before = gauss_newton(problem, (limit,), (1.05 * FRICTION,), np.ones(W), iterations=1)
    assert last_step(problem, (limit,), (1.05 * FRICTION,), np.ones(W)).values[0] == as_before.values[0]


def test_of_nothing_it_is_the_fit_of_the_declared_model() -> None:
    problem, ones = Rough(), np.ones(W)
    fit = last_step(problem, (), np.empty(0), ones)
    assert fit.chosen == ()
    assert fit.effects == []
    assert fit.cost == pytest.approx(gauss_newton(problem, (), (), ones).cost)
