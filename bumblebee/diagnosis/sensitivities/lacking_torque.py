"""The torque that the declared model lacks where the joints were measured to be: by inverse dynamics, not simulation.

A model that is far from the data is no further off here than one that is near: nothing flies.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bumblebee.diagnosis.residuals import Problem
from bumblebee.diagnosis.sensitivities.impulse_responses import Path, commanded
from bumblebee.diagnosis.sensitivities.torque_signatures import Signatures
from bumblebee.diagnosis.simulation import vary
from bumblebee.diagnosis.thresholds.sensitivities import Impulses
from bumblebee.sim.effects import Effect


@dataclass(frozen=True, eq=False)
class LackingTorque:
    """Means over segments of W windows."""

    problem: Problem
    signatures: Signatures
    """Torques that effects would be on the measured path."""
    asked: np.ndarray
    """(W, S, nv) that the motion asks of the declared model's drives [N m]."""

    def after(self, effects: Sequence[Effect] = ()) -> np.ndarray:
        """Torque (W, S, nv) [N m] that is lacking by the commands as `effects` make them arrive."""
        plant, of = self.problem.plant, self.signatures
        control, _ = commanded(self.problem.windows, vary(plant, effects), of.path.step, len(of.path.edges) - 1)
        lacking = self.asked.copy()
        lacking[..., plant.dof] -= of.path.mean(of.servos.torque(of.q, of.v, of.servos.controls(control)))
        return lacking

    def damped(self) -> np.ndarray:
        """Torque (W, S, nv) [N m] of the servos' damping."""
        damped = np.zeros_like(self.asked)
        damped[..., self.problem.plant.dof] = self.signatures.path.mean(
            self.signatures.servos.bias[..., 2] * self.signatures.v
        )
        return damped

    def moving(self) -> np.ndarray:
        """How far (W, S, nv) each joint moves in one direction, 0 to 1: at rest any friction is as large as it must."""
        moving = np.ones_like(self.asked)
        moving[..., self.problem.plant.dof] = self.signatures.path.mean(self.signatures.sign) ** 2
        return moving


def lacking_torque(problem: Problem) -> LackingTorque:
    """Inverse dynamics less the drives' torques, of the declared model of a robot whose base is fixed."""
    plant, rules = problem.plant, problem.thresholds.sensitivities
    path = _measured_path(problem, rules.impulses)
    signatures = Signatures(plant, problem.windows, vary(plant, []), path, rules.signatures)
    asked = np.empty((len(problem.windows), len(path.edges) - 1, plant.model.nv))
    for number, under in enumerate(plant.every):
        where = problem.windows.condition == number
        asked[where] = signatures.inverse_dynamics(under.model)[where]
    asked[..., plant.dof] += plant.model.dof_frictionloss[plant.dof] * path.mean(signatures.sign)
    return LackingTorque(problem, signatures, asked)


def _measured_path(problem: Problem, rule: Impulses) -> Path:
    """The windows as they were measured, between ticks on straight lines."""
    plant, windows, step = problem.plant, problem.windows, problem.coarse
    control, edges = commanded(windows, vary(plant, []), step, rule.segments)
    count = control.shape[1]
    qpos = np.repeat(windows.qpos[:, None], count + 1, axis=1)
    qvel = np.repeat(windows.qvel[:, None], count + 1, axis=1)
    at = step * np.arange(count + 1)
    for w, (i, k) in enumerate(zip(windows.rollout, windows.start, strict=True)):
        rollout = windows.source[i]
        time = rollout.time - rollout.time[k]
        for j, (q, v) in enumerate(zip(plant.qpos, plant.dof, strict=True)):
            qpos[w, :, q] = np.interp(at, time, rollout.joint_pos[:, j])
            qvel[w, :, v] = np.interp(at, time, rollout.joint_vel[:, j])
    return Path(step, qpos, qvel, control, edges, np.zeros((len(windows), count + 1, plant.model.na)))
