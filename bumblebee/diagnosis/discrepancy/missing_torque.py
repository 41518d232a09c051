"""One set of windows around one fit, ready to be asked what torques the fit lacks."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bumblebee.diagnosis.discrepancy.regressors import Quantities, quantities
from bumblebee.diagnosis.discrepancy.torque_scores import Evidence, joint_answers, make_evidence
from bumblebee.diagnosis.estimation import Fit, project, solve
from bumblebee.diagnosis.residuals import Problem, window_weights
from bumblebee.diagnosis.sensitivities import answers_of, pulse_sizes
from bumblebee.diagnosis.simulation import vary
from bumblebee.sim.effects import Effect


@dataclass(frozen=True, eq=False)
class Scene:
    """W windows; what needs answers to torques is simulated when it is first asked for."""

    problem: Problem
    residual: np.ndarray
    """(W, M) whitened, nuisances not taken out."""
    columns: np.ndarray
    """(F, W, M) of the chosen effects; none on windows that take no part in the fit."""
    effects: Sequence[Effect]
    weights: np.ndarray
    """(W,)."""
    torque: np.ndarray
    """(J,) [N m] typical of the joints."""
    joints: Sequence[int] | None = None
    """Those that are asked about, all by default; of others nothing is known."""

    @cached_property
    def left(self) -> np.ndarray:
        """(W, M) residual with nuisances and columns taken out."""
        basis, inverse = project(self.problem, self.columns, self.weights)
        return self.residual - np.tensordot(solve(basis, inverse, self.residual, self.weights), basis, axes=1)

    @cached_property
    def _seen(self) -> tuple[Evidence, Quantities]:
        """From the answers to pulses on the joints; the declared model's where effects change the layout."""
        problem, plant, windows = self.problem, self.problem.plant, self.problem.windows
        variation = vary(plant, self.effects)
        variation = variation.bare if variation.plant is None else vary(plant, [])
        only = plant.dof if self.joints is None else plant.dof[list(self.joints)]
        sizes, segments = pulse_sizes(problem, self.torque), problem.thresholds.sensitivities.impulses.segments
        answers = answers_of(plant, problem.layout, windows, variation, problem.coarse, sizes, only, segments)
        white = joint_answers(problem, answers)
        evidence = make_evidence(problem, white, self.residual, self.columns, self.weights)
        return evidence, quantities(plant, windows, answers.path, variation.models, problem.thresholds.discrepancy)

    @property
    def evidence(self) -> Evidence:
        """On torques of the joints."""
        return self._seen[0]

    @property
    def data(self) -> Quantities:
        """Quantities that a basis function may depend on."""
        return self._seen[1]

    def excess(self, spared: int = 0) -> np.ndarray:
        """(J,) by how many standard errors a joint's torques are larger than noise makes them, see `quiet_excess`."""
        return np.array([self.quiet_excess(j, spared) for j in range(self.evidence.joints)])

    def quiet_excess(self, joint: int, spared: int = 0, rollouts: Sequence[int] | None = None) -> float:
        """Excess of one joint on some rollouts, all by default, each less the `spared` windows that say most."""
        of = self.problem.windows.rollout
        ids = np.unique(of) if rollouts is None else rollouts
        each = self.evidence.chi_square
        parts = [each(joint, of == i, spared) for i in ids] if spared else [each(joint)]
        value, count = np.sum(parts, axis=0)
        return float((value - count) / np.sqrt(2.0 * max(count, 1)))

    def reduced_chi_square(self, spared: int = 0) -> tuple[float, float]:
        """Mean square of what is left, 1 for noise, and its standard error; without each rollout's loudest windows."""
        squares, rollouts = (self.left**2).mean(axis=1), self.problem.windows.rollout
        each = [np.sort(squares[rollouts == i]) for i in np.unique(rollouts)]
        kept = np.concatenate([some[: len(some) - spared] for some in each if len(some) > spared] or [np.ones(1)])
        values = self.left.shape[1]
        error = kept.std(ddof=1) if len(kept) > 1 else np.inf
        return float(kept.mean()), float(max(error, np.sqrt(2.0 / values)) / np.sqrt(len(kept)))


def fitted_scene(problem: Problem, fit: Fit, torque: np.ndarray, joints: Sequence[int] | None = None) -> Scene:
    """The windows of a fit; `torque` (J,) [N m] is typical of the joints. With `joints` these alone are asked about."""
    weights = window_weights(fit.clean(problem))
    return Scene(problem, fit.residual, fit.columns, fit.effects, weights, torque, joints)


def validation_scene(problem: Problem, fit: Fit, torque: np.ndarray, joints: Sequence[int] | None = None) -> Scene:
    """Windows that took no part in `fit`: its effects as they are, its numerical differences taken out."""
    residual = problem.residual([fit.effects])[0]
    residual = residual - np.tensordot(fit.nuisance, problem.nuisance, axes=1)
    none, ones = np.empty((0, *residual.shape)), np.ones(len(residual))
    return Scene(problem, residual, none, fit.effects, ones, torque, joints)
