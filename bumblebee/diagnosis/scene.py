"""One set of windows around one fit, ready to be asked what torques the fit lacks."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bumblebee.diagnosis.evidence import Evidence, joint_answers, make_evidence
from bumblebee.diagnosis.fit import Fit
from bumblebee.diagnosis.problem import Problem, window_weights
from bumblebee.diagnosis.pulses import answers_of
from bumblebee.diagnosis.quantities import Quantities, quantities
from bumblebee.diagnosis.screen import pulse_sizes
from bumblebee.diagnosis.variation import Variation, vary


@dataclass(frozen=True, eq=False)
class Scene:
    """W windows."""

    problem: Problem
    residual: np.ndarray
    """(W, M) whitened, nuisances not taken out."""
    columns: np.ndarray
    """(F, W, M) of the chosen effects; none on windows that take no part in the fit."""
    evidence: Evidence
    data: Quantities

    def excess(self) -> np.ndarray:
        """(J,) by how many standard errors a joint's torques are larger than noise makes them."""
        return np.array([self.quiet_excess(j) for j in range(self.evidence.joints)])

    def quiet_excess(self, joint: int, spared: int = 0, some: np.ndarray | None = None) -> float:
        """The same of one joint on some windows (W,) bool, all by default, less the `spared` ones that say most."""
        value, count = self.evidence.free(joint, some, spared)
        return float((value - count) / np.sqrt(2.0 * max(count, 1)))

    def power(self, spared: int = 0) -> tuple[float, float]:
        """Mean square of what is left, 1 for noise, and its standard error; without each rollout's loudest windows."""
        powers, rollouts = (self.evidence.left**2).mean(axis=1), self.problem.windows.rollout
        each = [np.sort(powers[rollouts == i]) for i in np.unique(rollouts)]
        kept = np.concatenate([some[: len(some) - spared] for some in each if len(some) > spared] or [np.ones(1)])
        values = self.evidence.left.shape[1]
        error = kept.std(ddof=1) if len(kept) > 1 else np.inf
        return float(kept.mean()), float(max(error, np.sqrt(2.0 / values)) / np.sqrt(len(kept)))


def fitted_scene(problem: Problem, fit: Fit, torque: np.ndarray) -> Scene:
    """The windows of a fit; `torque` (J,) [N m] is typical of the joints."""
    return _scene(problem, fit.residual, fit.columns, fit.effects, window_weights(fit.clean(problem)), torque)


def judged_scene(problem: Problem, fit: Fit, torque: np.ndarray) -> Scene:
    """Windows that took no part in `fit`: its effects as they are, its numerical differences taken out."""
    residual = problem.residual([fit.effects])[0]
    residual = residual - np.tensordot(fit.nuisance, problem.nuisance, axes=1)
    return _scene(problem, residual, np.empty((0, *residual.shape)), fit.effects, np.ones(len(residual)), torque)


def _scene(
    problem: Problem,
    residual: np.ndarray,
    columns: np.ndarray,
    effects: Sequence,
    weights: np.ndarray,
    torque: np.ndarray,
) -> Scene:
    plant, layout, windows = problem.plant, problem.layout, problem.windows
    variation = vary(plant, effects)
    if variation.plant is None:
        variation = Variation(variation.model, variation.delay, variation.offset)
    else:
        variation = vary(plant, [])
    sizes = pulse_sizes(problem, torque)
    answers = answers_of(plant, layout, windows, variation, problem.coarse, sizes, only=plant.dof)
    evidence = make_evidence(problem, joint_answers(problem, answers), residual, columns, weights)
    return Scene(problem, residual, columns, evidence, quantities(plant, windows, answers.path, variation.model))
