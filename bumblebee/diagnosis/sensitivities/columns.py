"""Columns of all candidates on some of the windows: from torque answers where an effect is a torque, else simulated."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bumblebee.diagnosis.candidates import Candidate, is_simulated, shortlisted
from bumblebee.diagnosis.residuals import Problem
from bumblebee.diagnosis.sensitivities.impulse_responses import Answers, answers_of
from bumblebee.diagnosis.sensitivities.torque_signatures import Signatures
from bumblebee.diagnosis.simulation import Plant, begin_setpoints, setpoints_of, vary
from bumblebee.sim.effects import SETPOINTS, Effect


@dataclass(frozen=True, eq=False)
class Answered:
    """Responses of the W windows of a screening to pulses, with a model of some effects."""

    effects: Sequence[Effect]
    white: np.ndarray
    """(W, nv, S, M) the whitened answers."""
    of: tuple[object, ...]
    """Windows and whitening of the problem that some were screened of."""

    def on(self, problem: Problem) -> "Answered | None":
        """These, if they are of the problem's windows."""
        same = self.of[0] is problem.windows and self.of[1] is problem.whitener
        return self if same else None


@dataclass(frozen=True, eq=False)
class Columns:
    """Columns of many candidates on one set of windows."""

    candidates: Sequence[Candidate]
    values: np.ndarray
    """(sum of F, W, M) float32."""

    @property
    def slices(self) -> list[slice]:
        """Rows of each candidate."""
        ends = np.cumsum([len(c.free) for c in self.candidates]).tolist()
        return [slice(end - len(c.free), end) for c, end in zip(self.candidates, ends, strict=True)]

    def only(self, keep: Sequence[int]) -> "Columns":
        """Those of some of the candidates."""
        slices = self.slices
        rows = np.concatenate([np.arange(slices[k].start, slices[k].stop) for k in keep])
        return Columns([self.candidates[k] for k in keep], self.values[rows])


def screen(
    problem: Problem,
    candidates: Sequence[Candidate],
    effects: Sequence[Effect],
    torque: np.ndarray,
    before: Answered | None = None,
) -> tuple[Columns, np.ndarray]:
    """Columns of `candidates` on the problem's windows, around the model with `effects`; and the whitened answers.

    `torque` (nv,) is a pulse that matters on each degree of freedom. Candidates that are only shortlisted have none.
    Answers of `before` to pulses that are not next to an effect that has changed since are taken for this model's.
    """
    kept = [c for c in candidates if not shortlisted(c, len(problem.plant.joints))]
    variation = vary(problem.plant, effects)
    plain = variation.bare if variation.plant is None else None
    around = plain or vary(problem.plant, [])
    only = _near(problem.plant, before.effects, effects) if before is not None else np.arange(problem.plant.model.nv)
    rules, scene = problem.thresholds.sensitivities, (problem.plant, problem.layout, problem.windows)
    answers = answers_of(*scene, around, problem.coarse, torque, only=only, segments=rules.impulses.segments)
    fresh = _whitened(problem, answers, only)
    white = fresh if before is None else before.white.copy()
    white[:, only] = fresh
    shaped = [c.at(c.start) for c in kept if c.effect in SETPOINTS]
    begin_setpoints(problem.windows, setpoints_of(problem.plant, shaped))
    signatures = Signatures(problem.plant, problem.windows, around, answers.path, rules.signatures)
    ends = np.cumsum([len(c.free) for c in kept]).tolist()
    values = np.empty((ends[-1] if ends else 0, *problem.nuisance.shape[1:]), dtype=np.float32)
    simulated, torques = [], []
    for c, end in zip(kept, ends, strict=True):
        if is_simulated(c, len(problem.plant.joints)):
            simulated.append((c, end - len(c.free)))
        else:
            torques.append((end - len(c.free), signatures.of(c).astype(np.float32)))
    _fill(values, torques, white)
    for c, end in zip(kept, ends, strict=True):
        if c.effect == "encoder_delay" and not is_simulated(c, len(problem.plant.joints)):
            values[end - 1] += signatures.late.readings(problem, c.start[0], problem.plant.joints.index(c.where))
    _simulate(problem, values, simulated, effects)
    return Columns(kept, values), white


def _simulate(
    problem: Problem, values: np.ndarray, simulated: Sequence[tuple[Candidate, int]], effects: Sequence[Effect]
) -> None:
    """Set the rows of `values` (., W, M) to the simulated columns of candidates, each from its first row on."""
    if not simulated:
        return
    drawn = problem.sensitivities([c for c, _ in simulated], list(effects))
    first = 0
    for c, where in simulated:
        values[where : where + len(c.free)] = drawn[first : first + len(c.free)]
        first += len(c.free)


def _fill(values: np.ndarray, torques: Sequence[tuple[int, np.ndarray]], white: np.ndarray) -> None:
    """Set the rows of `values` (., W, M) to the answers to torques.

    Args:
        values: columns of all candidates.
        torques: first row and torques (F, W, S, nv) of each candidate.
        white: (W, nv, S, M) whitened answers.
    """
    groups: dict[int, list[tuple[int, np.ndarray]]] = {}
    for first, torque in torques:
        felt = np.flatnonzero(torque.any(axis=(0, 1, 2)))
        groups.setdefault(int(felt[0]) if len(felt) == 1 else -1, []).append((first, torque))
    for dof, some in groups.items():  # all of a degree of freedom at once: one by one they cost seconds
        rows = np.concatenate([np.arange(first, first + len(torque)) for first, torque in some])
        each = [
            torque[..., dof] if dof >= 0 else torque.swapaxes(2, 3).reshape(*torque.shape[:2], -1) for _, torque in some
        ]
        answers = white[:, dof] if dof >= 0 else white.reshape(len(white), -1, white.shape[-1])
        values[rows] = np.matmul(np.concatenate(each).transpose(1, 0, 2), answers).transpose(1, 0, 2)


def _near(plant: Plant, before: Sequence[Effect], now: Sequence[Effect]) -> np.ndarray:
    """Degrees of freedom of the bodies on which an effect has changed and of those next to them; all, if one has none.

    An effect's own body, the one that it hangs on and those that hang on it.
    """
    model, changed = plant.model, [e for e in (*before, *now) if e not in before or e not in now]
    names = {name for e in changed for name in e.where}
    if not names or any(not e.where for e in changed) or not names <= {*plant.joints, *plant.bodies}:
        return np.arange(model.nv)
    own = [int(model.joint(n).bodyid[0]) if n in plant.joints else int(model.body(n).id) for n in names]
    bodies = {*own, *model.body_parentid[own].tolist(), *np.flatnonzero(np.isin(model.body_parentid, own)).tolist()}
    return np.flatnonzero(np.isin(model.dof_bodyid, list(bodies)))


def _whitened(problem: Problem, answers: Answers, only: np.ndarray) -> np.ndarray:
    """(W, K, S, M): the answers to pulses on K of the degrees of freedom as the residual's whitened change."""
    raw = answers.torque[only]
    white = problem.whitener(raw.reshape(-1, *raw.shape[2:]), centre=False)
    return white.reshape(*raw.shape[:3], -1).transpose(2, 0, 1, 3).astype(np.float32)


def pulse_sizes(problem: Problem, torque: np.ndarray) -> np.ndarray:
    """(nv,) pulses [N m, N]: shares of the joints' typical torque (J,), on a floating base of the weight."""
    plant, rule = problem.plant, problem.thresholds.sensitivities.impulses
    out = np.full(plant.model.nv, rule.torque * float(np.median(torque)))
    out[plant.dof] = rule.torque * torque
    if plant.floating:
        weight = 9.81 * float(plant.model.body_mass.sum())
        out[plant.base_dof : plant.base_dof + 3] = rule.force * weight
        out[plant.base_dof + 3 : plant.base_dof + 6] = rule.moment * weight
    return np.maximum(out, 1e-9)
