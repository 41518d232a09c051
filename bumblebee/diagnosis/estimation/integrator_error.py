"""Whether an effect is more than what another simulator would do.

The truth has an integrator and a step of its own. With enough data the difference is significant, beside the nuisances
too, and takes the name of an effect: with 30 rollouts it was called armature on three light joints. The size of that
difference does not grow with the data, so it is simulated: the same model by other integrators. An effect counts if
what it changes is clearly more than what these would feign of it.
"""

import copy
from collections.abc import Iterator
from dataclasses import replace

import mujoco
import numpy as np

from bumblebee.diagnosis.estimation.fit import Fit
from bumblebee.diagnosis.estimation.least_squares import project, solve
from bumblebee.diagnosis.residuals import Problem
from bumblebee.diagnosis.simulation import Variation, damping_rates, residuals, vary


def explained_share(problem: Problem, before: Fit, after: Fit, weights: np.ndarray) -> float:
    """Share of the change from `before` to `after` that other integrators would make, the largest of those tried.

    Both are compared beside the nuisances and the columns of `before`; 0 where no other integrator runs.
    """
    basis, inverse = project(problem, before.columns, weights)

    def left(values: np.ndarray) -> np.ndarray:
        return values - np.tensordot(solve(basis, inverse, values, weights), basis, axes=1)

    change = left(before.residual - after.residual)
    shares = [0.0]
    for differs in _differences(problem, before):
        weight = weights[:, None] * change
        shares.append(abs(float((weight * left(differs)).sum() / max((weight * change).sum(), 1e-12))))
    return max(shares) * problem.finest / problem.fine  # of first order in the step


def moves(problem: Problem, fit: Fit, weights: np.ndarray) -> np.ndarray:
    """By how much (P,) other integrators would move the fitted values, the most of those tried, to first order.

    0 for a parameter that is not fitted and where no other integrator runs.
    """
    basis, inverse = project(problem, fit.columns, weights)
    moving, first = np.flatnonzero(fit.scales), len(problem.nuisance)
    out = np.zeros(len(fit.scales))
    for differs in _differences(problem, fit):
        move = solve(basis, inverse, differs, weights)[first:] * fit.scales[moving]
        out[moving] = np.maximum(out[moving], np.abs(move))
    return out


def beyond_numerics(problem: Problem, before: Fit, after: Fit, weights: np.ndarray) -> bool:
    """Whether the change from `before` to `after` is clearly more than another integrator's."""
    return explained_share(problem, before, after, weights) < problem.thresholds.estimation.integrator_error.explained


def _differences(problem: Problem, fit: Fit) -> Iterator[np.ndarray]:
    """Changes of the whitened residual (W, M) by other integrators; 0 in windows that diverge or shake."""
    tilted = problem.tilted(fit.effects)
    residual = fit.residual if tilted is None else fit.residual - tilted
    for other in _others(vary(problem.plant, problem.as_whitened(fit.effects))):
        raw = residuals(problem.plant, problem.layout, problem.windows, [other], problem.fine)[0]
        good = np.isfinite(raw).all(axis=(1, 2))
        if int(other.model.opt.integrator) == int(mujoco.mjtIntegrator.mjINT_EULER):
            explicit = bool(other.model.opt.disableflags & int(mujoco.mjtDisableBit.mjDSBL_EULERDAMP))
            good &= damping_rates(problem.plant, other, problem.windows, joints=explicit) * problem.fine < 1.0
        if good.mean() >= problem.thresholds.estimation.integrator_error.finite:
            yield np.where(good[:, None], problem.whitener(raw) - residual, 0.0)


def _others(variation: Variation) -> list[Variation]:
    """The model by Euler steps with explicit servos, and by fully implicit steps."""
    integrators = (mujoco.mjtIntegrator.mjINT_EULER, mujoco.mjtIntegrator.mjINT_IMPLICIT)
    return [_with_integrator(variation, i) for i in integrators if int(variation.model.opt.integrator) != int(i)]


def _with_integrator(variation: Variation, integrator: mujoco.mjtIntegrator) -> Variation:
    models = [copy.copy(model) for model in variation.models]
    for model in models:
        model.opt.integrator = int(integrator)
    return replace(variation, model=models[0], others=tuple(models[1:]))
