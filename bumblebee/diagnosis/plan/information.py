"""Expected information of runs: Gram matrices of whitened sensitivities on windows of simulated runs.

Windows are cut, whitened and differentiated as those of a diagnosis are, around the declared model; information adds up
over windows, so a plan's is the sum of its runs'. The first rows are the diagnosis's nuisances.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bumblebee.diagnosis.candidates import scales_of
from bumblebee.diagnosis.plan.basis import Basis
from bumblebee.diagnosis.plan.machine import Machine
from bumblebee.diagnosis.plan.motions import Motion
from bumblebee.diagnosis.plan.rehearsal import Rehearsed
from bumblebee.diagnosis.residuals import Problem, make_problem
from bumblebee.diagnosis.sensitivities import pulse_sizes, screen
from bumblebee.diagnosis.simulation import Layout, Plant, choose_starts, cut
from bumblebee.diagnosis.thresholds import Thresholds
from bumblebee.errors import BadInput
from bumblebee.measured.rollout import Rollout


@dataclass(frozen=True, eq=False)
class Lens:
    """Settings and models that information is computed with."""

    basis: Basis
    typical: np.ndarray
    """(J,) RMS torques [N m], by which pulses are sized."""
    sigma: np.ndarray
    """(D,) noise."""
    steps: tuple[float, float]
    """[s] for residuals and for sensitivities."""
    horizon: float
    """Length of a window [s]."""
    thresholds: Thresholds
    seed: int = 0


def lens_of(
    machine: Machine, plant: Plant, rollouts: Sequence[Rollout], basis: Basis, horizon: float, rules: Thresholds
) -> Lens:
    """The lens for a robot whose signals are as large as those of `rollouts`."""
    typical = scales_of(plant, rollouts, rules.candidates.scales).torque
    return Lens(basis, typical, machine.sigma, machine.steps, horizon, rules)


def logs_of(machine: Machine, runs: Rehearsed, motions: Sequence[Motion]) -> list[Rollout]:
    """The runs as a logger without noise writes them, with the columns that the diagnosis takes."""
    out = []
    for r, motion in enumerate(motions):
        parts = {name: runs.reading[r][:, part] for name, part in runs.layout.slices.items()}
        example = machine.seen[motion.gain].example
        commands = {"joint_target": motion.targets, "joint_torque_cmd": runs.torque[r]}
        columns = {name: commands[name] for name in commands if getattr(example, name) is not None}
        if runs.quat is not None:
            columns |= {name: parts[name] for name in ("base_ang_vel", "base_lin_vel")} | {"base_quat": runs.quat[r]}
            columns |= {"base_pos": parts["base_pos"]} if "base_pos" in machine.seen_layout.slices else {}
        time = np.arange(len(motion.shape)) / machine.rate
        out.append(
            Rollout(
                f"p{motion.number:04d}", machine.joints, machine.rate, time, parts["joint_pos"],
                parts["joint_vel"], meta=dict(example.meta), **columns,
            )
        )  # fmt: skip
    return out


def information_of(plant: Plant, layout: Layout, rollouts: Sequence[Rollout], lens: Lens, budget: int) -> np.ndarray:
    """Information (R, B + K, B + K) of rollouts, from at most `budget` windows each, as if all of them took part."""
    size = lens.thresholds.plan.information.together
    parts = []
    for first in range(0, len(rollouts), size):
        some = rollouts[first : first + size]
        starts = choose_starts(some, list(range(len(some))), lens.horizon, budget * len(some))
        if not starts:
            raise BadInput(
                "plan", f"runs that hold windows of {lens.horizon:g} s", "shorter ones", "Ask for --seconds."
            )
        windows = cut(plant, layout, some, starts)
        rng = np.random.default_rng([lens.seed, first])
        problem = make_problem(plant, layout, windows, lens.sigma, lens.steps, [], rng, None, lens.thresholds)
        rows = np.concatenate((problem.nuisance.astype(np.float32), columns_of(problem, lens)))
        parts.append(_grams(problem, rows, some, lens.horizon))
    return np.concatenate(parts)


def columns_of(problem: Problem, lens: Lens) -> np.ndarray:
    """(K, W, M) columns of the basis: by impulse responses where the diagnosis has them, else simulated."""
    basis = lens.basis
    made, _ = screen(problem, basis.candidates, [], pulse_sizes(problem, lens.typical))
    where = {id(c): span for c, span in zip(made.candidates, made.slices, strict=True)}
    out = np.empty((basis.slices[-1].stop, *problem.nuisance.shape[1:]), dtype=np.float32)
    for c, span in zip(basis.candidates, basis.slices, strict=True):
        out[span] = made.values[where[id(c)]] if id(c) in where else problem.sensitivities([c])
    return np.nan_to_num(out)


def _grams(problem: Problem, rows: np.ndarray, rollouts: Sequence[Rollout], horizon: float) -> np.ndarray:
    """(R, N, N) products of rows (N, W, M), a rollout's windows standing for all that it holds."""
    out = np.zeros((len(rollouts), len(rows), len(rows)))
    for r, rollout in enumerate(rollouts):
        own = problem.windows.rollout == r
        if not own.any():
            continue
        flat = rows[:, own].reshape(len(rows), -1).astype(float)
        held = max(1.0, np.floor(rollout.duration / horizon))
        out[r] = (flat @ flat.T) * max(1.0, held / own.sum())
    return out
