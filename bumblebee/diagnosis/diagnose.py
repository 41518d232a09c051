"""The diagnosis from end to end: what the model lacks, how much of it, how sure, and what is left."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from bumblebee.diagnosis.candidates import Candidate, all_candidates, still_joints
from bumblebee.diagnosis.classes import detectable, equivalents
from bumblebee.diagnosis.error_block import error_block, floor_block, horizon_whiteners, horizon_windows
from bumblebee.diagnosis.fit import Fit, interval
from bumblebee.diagnosis.nuisance import NAMES
from bumblebee.diagnosis.problem import Problem, make_problem
from bumblebee.diagnosis.search import Search, SearchConfig, search
from bumblebee.diagnosis.session import Session
from bumblebee.diagnosis.simulate import residuals
from bumblebee.diagnosis.unexplained import unexplained
from bumblebee.diagnosis.variation import vary
from bumblebee.diagnosis.windows import choose_starts, cut
from bumblebee.errors import BadInput
from bumblebee.sim.effects import CATALOGUE, Effect


@dataclass(frozen=True)
class DiagnosisConfig:
    """How much work a diagnosis does."""

    horizon: float = 0.2
    """Length of the windows that effects are attributed on [s]."""
    max_windows: int = 120
    """Windows that take part in the fit."""
    max_holdout_windows: int = 60
    """Held-out windows that acceptance is decided on."""
    report_windows: int = 80
    """Windows for each horizon of the error block."""
    seed: int = 0
    search: SearchConfig = field(default_factory=SearchConfig)
    """How strict the search is."""


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """The outcome: the contract's document, the effects as values, and what the report draws from."""

    document: dict[str, Any]
    effects: list[Effect]
    session: Session
    search: Search
    problem: Problem


def diagnose(
    session: Session, config: DiagnosisConfig | None = None, say: Callable[[str], None] = lambda text: None
) -> Diagnosis:
    """Find the effects that the declared model of `session` lacks."""
    config = config or DiagnosisConfig()
    rng = np.random.default_rng(config.seed)
    still = still_joints(session.plant, session.rollouts, session.sigma)
    candidates = all_candidates(session.plant, session.rollouts, still)
    say(f"{len(session.train)} rollouts to fit, {len(session.holdout)} held out, {len(candidates)} candidates")
    problem = _problem(session, session.train, config.max_windows, config.horizon, rng)
    holdout = (
        _problem(session, session.holdout, config.max_holdout_windows, config.horizon, rng) if session.holdout else None
    )
    say(f"{len(problem.windows)} windows of {config.horizon:g} s; sensitivities of {len(candidates)} candidates")
    found = search(problem, holdout, candidates, config.search, say)
    say(f"{len(found.fit.chosen)} effects; error before and after")
    document = {"schema": 1, "train": session.ids(session.train), "holdout": session.ids(session.holdout)}
    document["effects"] = _effects(problem, holdout, found, candidates)
    judged = holdout or problem
    document["unexplained"] = unexplained(judged, _on(judged, found.fit), session.plant.joints, _torques(judged))
    document["error"] = _errors(session, found.fit.effects, config)
    document["unidentifiable"] = [
        {"where": [name], "why": "the joint moves no more than its sensor's noise"} for name in still
    ]
    document["smallest_detectable"] = detectable(candidates, found)
    document["notes"] = session.notes
    document["settings"] = {
        "timestep": session.steps[0],
        "windows": len(problem.windows),
        "horizon": config.horizon,
        "seed": config.seed,
        "numerics": dict(zip(NAMES, found.fit.nuisance.tolist(), strict=False)),
        "noise": dict(zip(session.layout.labels(session.plant.joints), session.sigma.tolist(), strict=True)),
    }
    return Diagnosis(document, found.fit.effects, session, found, problem)


def _problem(session: Session, ids: Sequence[int], budget: int, horizon: float, rng: np.random.Generator) -> Problem:
    starts = choose_starts(session.rollouts, ids, horizon, budget)
    if not starts:
        names = ", ".join(session.ids(ids)[:3])
        raise BadInput(f"rollouts {names}", f"stretches of {horizon:g} s", "shorter ones", "Record longer runs.")
    windows = cut(session.plant, session.layout, session.rollouts, starts)
    return make_problem(session.plant, session.layout, windows, session.sigma, session.steps, [], rng)


def _on(problem: Problem, fit: Fit) -> Fit:
    """The fit's values looked at on other windows."""
    residual = problem.residual([fit.effects])[0]
    return Fit(fit.chosen, fit.values, fit.nuisance, residual, np.empty((0, *residual.shape)), 0.0)


def _torques(problem: Problem) -> np.ndarray:
    """Servo torque of the declared model at each window's start, (W, J)."""
    plant, windows = problem.plant, problem.windows
    a = np.maximum(plant.actuator, 0)
    last = np.array([np.searchsorted(t, 1e-9) - 1 for t in windows.command_time])
    command = windows.command[np.arange(len(windows)), np.maximum(last, 0)][:, a]
    prm, gain = plant.model.actuator_biasprm[a], plant.model.actuator_gainprm[a, 0]
    return gain * command + prm[:, 0] + prm[:, 1] * windows.qpos[:, plant.qpos] + prm[:, 2] * windows.qvel[:, plant.dof]


def _effects(
    problem: Problem, holdout: Problem | None, found: Search, candidates: Sequence[Candidate]
) -> list[dict[str, Any]]:
    """The contract's list, most explaining first."""
    if not found.fit.chosen:
        return []
    _, half = interval(problem, found.fit, found.weights)
    shares = _explained(holdout or problem, found.fit)
    classes = equivalents(problem, candidates, found)
    steps = {s.candidate: s for s in found.steps}
    entries = []
    for i, candidate in enumerate(found.fit.chosen):
        kind, value = CATALOGUE[candidate.effect], float(found.fit.values[i])
        low, high = max(kind.lower, value - half[i]), min(kind.upper, value + half[i])
        entries.append(
            {
                "effect": candidate.effect,
                "where": [candidate.where],
                "parameters": {
                    kind.parameter: {
                        "value": value,
                        "ci95": [float(low), float(high)],
                        "nominal": candidate.nominal,
                        "unit": kind.unit,
                    }
                },
                "equivalent": classes[i],
                "explains": float(shares[i]),
                "evidence": {
                    "p": float(steps[candidate].p),
                    "test": f"Wald test in the joint fit, variance clustered by window, z = {steps[candidate].z:.1f}, "
                    f"Bonferroni over {len(candidates)} candidates",
                },
                "native": candidate.effect != "encoder_offset",
            }
        )
    return sorted(entries, key=lambda e: -e["explains"])


def _explained(problem: Problem, fit: Fit) -> np.ndarray:
    """Share of the excess of chi-square over its best value that comes back when an effect alone is taken out."""
    sets = [fit.effects] + [[e for k, e in enumerate(fit.effects) if k != i] for i in range(len(fit.chosen))] + [[]]
    left = problem.residual(sets) - np.tensordot(fit.nuisance, problem.nuisance, axes=1)
    power = (left**2).mean(axis=(1, 2))
    excess = max(power[-1] - power[0], 1e-12)
    return np.clip((power[1:-1] - power[0]) / excess, 0.0, 1.0)


def _errors(session: Session, effects: Sequence[Effect], config: DiagnosisConfig) -> dict[str, Any]:
    """before, after and floor on held-out rollouts (on all of them where there is only one)."""
    ids = session.holdout or session.train
    windows = horizon_windows(session.plant, session.layout, session.rollouts, ids, config.report_windows)
    before, after = vary(session.plant, []), vary(session.plant, effects)
    common = (session.plant, session.layout, windows)
    whiteners = horizon_whiteners(*common, after, session.sigma, session.steps[1], config.seed)
    fine = session.steps[0]
    return {
        "before": error_block(*common, whiteners, before, fine, config.seed),
        "after": error_block(*common, whiteners, after, fine, config.seed),
        "floor": floor_block(*common, whiteners, after, session.sigma, fine, config.seed),
    }


def example_window(diagnosis: Diagnosis) -> dict[str, Any]:
    """Measured, before and after in the joint and second where the effects matter most."""
    session = diagnosis.session
    ids = session.holdout or session.train
    starts = choose_starts(session.rollouts, ids, 0.6, 60) or choose_starts(session.rollouts, ids, 0.2, 60)
    windows = cut(session.plant, session.layout, session.rollouts, starts, outputs=120)
    models = [vary(session.plant, []), vary(session.plant, diagnosis.effects)]
    before, after = residuals(session.plant, session.layout, windows, models, session.steps[0])
    part = session.layout.slices["joint_pos"]
    scale = session.sigma[part]
    power = [np.nan_to_num((r[..., part] ** 2).mean(axis=1), nan=0.0) / scale**2 for r in (before, after)]
    gain = power[0] - power[1] if diagnosis.effects else power[0]
    w, j = np.unravel_index(int(np.argmax(gain)), gain.shape)
    measured = windows.measured[w, :, part][..., j]
    return {
        "rollout": session.rollouts[windows.rollout[w]].rollout_id,
        "start": float(session.rollouts[windows.rollout[w]].time[windows.start[w]]),
        "joint": session.plant.joints[j],
        "time": windows.out_time[w].tolist(),
        "measured": measured.tolist(),
        "before": (measured - before[w, :, part][..., j]).tolist(),
        "after": (measured - after[w, :, part][..., j]).tolist(),
    }
