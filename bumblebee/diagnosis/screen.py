"""Columns of all candidates on some of the windows: from torque answers where an effect is a torque, else simulated."""

from collections.abc import Sequence

import numpy as np

from bumblebee.diagnosis.candidates import Candidate, is_simulated, shortlisted
from bumblebee.diagnosis.problem import Problem
from bumblebee.diagnosis.pulses import Answers, answers_of
from bumblebee.diagnosis.scores import Columns
from bumblebee.diagnosis.signatures import Signatures
from bumblebee.diagnosis.variation import Variation, vary
from bumblebee.sim.effects import Effect

_RESTLESS = 1.5  # whitened power


def screening_windows(problem: Problem, budget: int) -> np.ndarray:
    """Indices of at most `budget` windows, spread evenly."""
    count = len(problem.windows)
    return np.unique(np.linspace(0, count - 1, min(budget, count)).round().astype(int))


def screen(
    problem: Problem, candidates: Sequence[Candidate], effects: Sequence[Effect], torque: np.ndarray
) -> tuple[Columns, np.ndarray]:
    """Columns of `candidates` on the problem's windows, around the model with `effects`; and the whitened answers.

    `torque` (nv,) is a pulse that matters on each degree of freedom. Candidates that are only shortlisted have none.
    """
    kept = [c for c in candidates if not shortlisted(c, len(problem.plant.joints))]
    variation = vary(problem.plant, effects)
    plain = Variation(variation.model, variation.delay, variation.offset) if variation.plant is None else None
    around = plain or vary(problem.plant, [])
    answers = answers_of(problem.plant, problem.layout, problem.windows, around, problem.coarse, torque)
    white = _whitened(problem, answers)
    signatures = Signatures(problem.plant, problem.windows, around, answers.path)
    rows = [len(c.free) for c in kept]
    values = np.empty((sum(rows), *problem.nuisance.shape[1:]), dtype=np.float32)
    simulated, at = [], 0
    for c, count in zip(kept, rows, strict=True):
        if is_simulated(c, len(problem.plant.joints)):
            simulated.append((c, at))
        else:
            torques = signatures.of(c).astype(np.float32)
            felt = np.flatnonzero(np.abs(torques).any(axis=(0, 1, 2)))  # a joint's effect is felt by its own dof alone
            flat = torques[..., felt].transpose(1, 0, 3, 2).reshape(len(problem.windows), count, -1)
            # A view where one degree of freedom is all: a copy for each of a thousand candidates costs seconds.
            own = white[:, felt[0]] if len(felt) == 1 else white[:, felt].reshape(len(flat), -1, white.shape[-1])
            values[at : at + count] = np.matmul(flat, own).transpose(1, 0, 2)
            if c.effect == "encoder_delay":
                values[at] += signatures.late.readings(problem, c.start[0], problem.plant.joints.index(c.where))
        at += count
    if simulated:
        drawn = problem.sensitivities([c for c, _ in simulated], list(effects))
        first = 0
        for c, where in simulated:
            values[where : where + len(c.free)] = drawn[first : first + len(c.free)]
            first += len(c.free)
    return Columns(kept, values), white


def _whitened(problem: Problem, answers: Answers) -> np.ndarray:
    """(W, nv, S, M): the answers as the residual's whitened change."""
    raw = answers.torque
    white = problem.whitener(raw.reshape(-1, *raw.shape[2:]), centre=False)
    return white.reshape(*raw.shape[:3], -1).transpose(2, 0, 1, 3).astype(np.float32)


def pulse_sizes(problem: Problem, torque: np.ndarray) -> np.ndarray:
    """(nv,) pulses of a tenth of the joints' typical torque (J,); a hundredth of the weight on a floating base."""
    plant = problem.plant
    out = np.full(plant.model.nv, 0.1 * float(np.median(torque)))
    out[plant.dof] = 0.1 * torque
    if plant.floating:
        weight = 9.81 * float(plant.model.body_mass.sum())
        out[plant.base_dof : plant.base_dof + 3] = 0.01 * weight
        out[plant.base_dof + 3 : plant.base_dof + 6] = 0.002 * weight
    return np.maximum(out, 1e-9)


def restless(problem: Problem, answers: np.ndarray, residual: np.ndarray, count: int) -> list[str]:
    """Joints that lack most torque, worst first: where play and shafts are worth a simulation.

    `answers` (W, nv, S, M) to pulses explain the whitened residual (W, M), all degrees of freedom together; a joint's
    power is the mean square of its torques in their own standard errors, 1 for noise.
    """
    size = answers.shape[1] * answers.shape[2]
    rows = answers.reshape(len(answers), size, -1).astype(float)
    scale = np.sqrt((rows**2).mean(axis=(0, 2), keepdims=True)) + 1e-12
    rows = rows / scale
    normal = np.matmul(rows, rows.transpose(0, 2, 1))
    normal[:, np.arange(size), np.arange(size)] += 1e-3 * normal.trace(axis1=1, axis2=2)[:, None] / size
    inverse = np.linalg.inv(normal)
    torque = np.matmul(inverse, np.matmul(rows, residual[:, :, None]))[..., 0]
    lacks = torque**2 / np.diagonal(inverse, axis1=1, axis2=2)
    power = lacks.reshape(len(answers), *answers.shape[1:3]).mean(axis=(0, 2))[problem.plant.dof]
    return [problem.plant.joints[j] for j in np.argsort(-power)[:count] if power[j] > _RESTLESS]
