"""The torque that the declared model lacks where the joints were measured to be: by inverse dynamics, not simulation.

A model that is far from the data is no further off here than one that is near: nothing flies. How hard the ground
pushes a robot whose base is free nobody measured: whatever torque it can make is unknown.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bumblebee.diagnosis.residuals import Problem
from bumblebee.diagnosis.sensitivities.ground import pushes, without_push
from bumblebee.diagnosis.sensitivities.impulse_responses import Path, commanded
from bumblebee.diagnosis.sensitivities.torque_signatures import Signatures
from bumblebee.diagnosis.simulation import start_state, vary
from bumblebee.diagnosis.thresholds.sensitivities import SensitivityThresholds
from bumblebee.sim.effects import Effect


@dataclass(frozen=True, eq=False)
class LackingTorque:
    """Means over segments of W windows."""

    problem: Problem
    signatures: Signatures
    """Torques that effects would be on the measured path."""
    moved: np.ndarray
    """(W, S, nv) that the motion asks of the declared model's drives and of the ground [N m, N]."""
    ground: np.ndarray
    """(W, S, nv, M) what unit forces and moments of the ground would be; M is 0 where the base is fixed."""
    within: bool = False
    """Whether the drives are taken never to have been at their limits, by gains that are lower than declared."""

    @cached_property
    def asked(self) -> np.ndarray:
        """Torque (W, S, nv) that the motion asks of the drives [N m], the ground's push by what holds the base."""
        return without_push(self.moved, self.ground, self.problem.plant)

    @cached_property
    def largest_scales(self) -> dict[str, float]:
        """Scale of its gains, less than 1, above which a drive would have been at its limit, where it is `within`."""
        if not self.within:
            return {}
        of, joints = self.signatures, self.problem.plant.joints
        raw = np.abs(of.servos.torque(of.q, of.v, of.u, limit=np.inf)) / of.servos.limit
        return {j: 1.0 / share for j, share in zip(joints, raw.max(axis=(0, 1)).tolist(), strict=True) if share > 1.0}

    def after(self, effects: Sequence[Effect] = ()) -> np.ndarray:
        """Torque (W, S, nv) [N m] that is lacking by the commands as `effects` make them arrive."""
        plant, of, limit = self.problem.plant, self.signatures, np.inf if self.within else None
        control, _ = commanded(self.problem.windows, vary(plant, effects), of.path.step, len(of.path.edges) - 1)
        lacking = self.moved.copy()
        lacking[..., plant.dof] -= of.path.mean(of.servos.torque(of.q, of.v, of.servos.controls(control), limit))
        return lacking

    def damped(self) -> np.ndarray:
        """Torque (W, S, nv) [N m] of the servos' damping."""
        damped = np.zeros_like(self.moved)
        damped[..., self.problem.plant.dof] = self.signatures.path.mean(
            self.signatures.servos.bias[..., 2] * self.signatures.v
        )
        return damped

    def moving(self) -> np.ndarray:
        """How far (W, S, nv) each joint moves in one direction, 0 to 1: at rest any friction is as large as it must."""
        moving = np.ones_like(self.moved)
        moving[..., self.problem.plant.dof] = self.signatures.path.mean(self.signatures.sign) ** 2
        return moving


def lacking_torque(problem: Problem) -> LackingTorque:
    """Inverse dynamics less the drives' torques, of the declared model."""
    plant, rules = problem.plant, problem.thresholds.sensitivities
    path = _measured_path(problem, rules)
    signatures = Signatures(plant, problem.windows, vary(plant, []), path, rules.signatures)
    moved = np.empty((len(problem.windows), len(path.edges) - 1, plant.model.nv))
    for number, under in enumerate(plant.every):
        where = problem.windows.condition == number
        moved[where] = signatures.inverse_dynamics(under.model)[where]
    moved[..., plant.dof] += plant.model.dof_frictionloss[plant.dof] * path.mean(signatures.sign)
    return LackingTorque(problem, signatures, moved, pushes(plant, signatures.middles()[0], rules.ground))


def _measured_path(problem: Problem, rules: SensitivityThresholds) -> Path:
    """The windows as they were measured, between ticks on straight lines."""
    plant, windows, step = problem.plant, problem.windows, problem.coarse
    control, edges = commanded(windows, vary(plant, []), step, rules.impulses.segments)
    count = control.shape[1]
    qpos = np.repeat(windows.qpos[:, None], count + 1, axis=1)
    qvel = np.repeat(windows.qvel[:, None], count + 1, axis=1)
    at = step * np.arange(count + 1)
    for w, (i, k) in enumerate(zip(windows.rollout, windows.start, strict=True)):
        rollout = windows.source[i]
        last = int(np.searchsorted(rollout.time, rollout.time[k] + at[-1])) + 1
        ticks = range(k, min(last, rollout.frames))
        height = windows.qpos[w, plant.base_qpos + 2] if windows.stance else None
        states = [start_state(plant, rollout, tick, height) for tick in ticks]
        for out, rows in ((qpos, [q for q, _ in states]), (qvel, [v for _, v in states])):
            for column, values in enumerate(np.transpose(rows)):
                out[w, :, column] = np.interp(at, rollout.time[ticks] - rollout.time[k], values)
    return Path(step, qpos, qvel, control, edges, np.zeros((len(windows), count + 1, plant.model.na)))
