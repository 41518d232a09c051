"""Which effects: score tests of every candidate given those chosen, trials in the simulator, held-out gain, pruning."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.stats import norm

from bumblebee.diagnosis.candidates import Candidate
from bumblebee.diagnosis.fit import Fit, covariance, gauss_newton, project, solve, standard_errors
from bumblebee.diagnosis.problem import Problem, window_weights


@dataclass(frozen=True)
class SearchConfig:
    """How strict and how long the search is."""

    level: float = 0.005
    """False alarms allowed for a whole null dataset, shared among the candidates (Bonferroni)."""
    trials: int = 6
    """Candidates a round that are tried in the simulator."""
    most: int = 12
    """Effects at most."""
    patience: int = 8
    """Rounds that may fail before the search ends."""
    holdout_z: float = 2.0
    """Held-out gain must exceed this many of its standard errors."""
    least_gain: float = 0.02
    """Held-out gain must exceed this share of the held-out chi-square that is left: with enough data the difference of
    two integrators is significant too, and was named armature on three light joints at a gain of 0.008."""


@dataclass(eq=False)
class Step:
    """One accepted effect: the evidence for it when it was accepted."""

    candidate: Candidate
    z: float
    p: float
    holdout_before: float
    holdout_after: float


@dataclass(eq=False)
class Search:
    """Outcome: the final fit and the way there."""

    fit: Fit
    steps: list[Step]
    columns: np.ndarray
    """(C, W, M) sensitivities of all candidates at the declared model."""
    weights: np.ndarray
    tests: np.ndarray
    """(C, 2) z and standard error (in steps) of every candidate given the chosen ones."""
    rejected: list[str] = field(default_factory=list)


def score_tests(problem: Problem, columns: np.ndarray, fit: Fit, weights: np.ndarray) -> np.ndarray:
    """Of every candidate given the fit: estimate [steps], its standard error, z, gain in cost; (C, 4)."""
    basis, inverse = project(problem, fit.columns, weights)
    nuisance = solve(basis, inverse, fit.residual, weights)
    left = fit.residual - np.tensordot(nuisance, basis, axes=1)
    root = np.sqrt(weights)
    weighted = (basis * weights[:, None]).reshape(len(basis), -1)
    flat = columns.reshape(len(columns), -1)
    shares = (flat @ weighted.T) @ inverse
    out = np.zeros((len(columns), 4))
    for c in range(len(columns)):
        own = columns[c] - np.tensordot(shares[c], basis, axes=1)
        own, part = own * root[:, None], left * root[:, None]
        curvature = (own**2).sum()
        raw = (columns[c] ** 2 * weights[:, None]).sum()
        if curvature < 1e-3 * raw or curvature < 1e-6:
            out[c, 1] = np.inf
            continue
        scores = (own * part).sum(axis=1)
        spread = np.sqrt(max(((scores - scores.mean()) ** 2).sum(), 0.25 * curvature))
        out[c] = scores.sum() / curvature, spread / curvature, scores.sum() / spread, scores.sum() ** 2 / curvature
    return out


def search(
    problem: Problem,
    holdout: Problem | None,
    candidates: Sequence[Candidate],
    config: SearchConfig,
    say: Callable[[str], None] = lambda text: None,
) -> Search:
    """Forward selection with joint refits, then pruning."""
    columns = problem.sensitivities(candidates)
    start = problem.residual([[]])[0]
    weights = window_weights(start)
    fit = gauss_newton(problem, (), (), weights)
    bound = norm.isf(config.level / (2 * len(candidates)))
    steps: list[Step] = []
    rejected: list[str] = []
    closed: set[int] = set()
    vain = 0
    while len(fit.chosen) < config.most:
        tests = score_tests(problem, columns, fit, weights)
        order = [c for c in np.argsort(-tests[:, 3]) if _open(c, candidates, fit, closed, tests, bound)]
        if not order:
            break
        trials = [t for c in order[: config.trials] if (t := _try(problem, fit, candidates[c], tests[c], weights))]
        trials = [t for t in trials if t[1] < fit.cost - bound**2 / 2]
        if not trials:
            closed |= set(order[: config.trials])
            vain += 1
            if vain >= config.patience:
                break
            continue
        candidate, _, value = min(trials, key=lambda t: t[1])
        fresh = gauss_newton(problem, (*fit.chosen, candidate), (*fit.values, value), weights)
        step = _evidence(problem, holdout, fit, fresh, weights, len(candidates), config)
        if step is None:
            rejected.append(f"{candidate.effect} on {candidate.where}")
            closed.add(candidates.index(candidate))
            vain += 1
            if vain >= config.patience:
                break
            continue
        fit = fresh
        steps.append(step)
        say(f"found {candidate.effect} on {candidate.where}: {fit.values[-1]:.4g}")
        weights = window_weights(fit.clean(problem))
        fit = gauss_newton(problem, fit.chosen, fit.values, weights, iterations=2)
    fit, weights = _prune(problem, fit, weights, bound)
    tests = score_tests(problem, columns, fit, weights)
    steps = [s for s in steps if s.candidate in fit.chosen]
    return Search(fit, steps, columns, weights, tests[:, [2, 1]], rejected)


def _open(c: int, candidates: Sequence[Candidate], fit: Fit, closed: set[int], tests: np.ndarray, bound: float) -> bool:
    """Whether a candidate is significant, can move the way it wants to, and has not been tried in vain."""
    candidate = candidates[c]
    if c in closed or candidate in fit.chosen or abs(tests[c, 2]) < bound:
        return False
    wanted = candidate.nominal + tests[c, 0] * candidate.step
    return abs(candidate.clip(wanted) - candidate.nominal) > 1e-3 * abs(candidate.step)


def _try(
    problem: Problem, fit: Fit, candidate: Candidate, test: np.ndarray, weights: np.ndarray
) -> tuple[Candidate, float, float] | None:
    """Secant steps of one candidate's size, the chosen ones free to move linearly: (candidate, cost, value)."""
    basis, inverse = project(problem, fit.columns, weights)
    value = candidate.clip(candidate.nominal + test[0] * candidate.step)
    best: tuple[Candidate, float, float] | None = None
    for _ in range(3):
        residual = problem.residual([[*fit.effects, candidate.at(value)]])[0]
        left = residual - np.tensordot(solve(basis, inverse, residual, weights), basis, axes=1)
        cost = float((weights[:, None] * left**2).sum())
        if best is None or cost < best[1]:
            best = (candidate, cost, value)
        change = fit.residual - residual
        change = change - np.tensordot(solve(basis, inverse, change, weights), basis, axes=1)
        size = (weights[:, None] * change**2).sum()
        if size < 1e-9:
            return None
        before = fit.residual - np.tensordot(solve(basis, inverse, fit.residual, weights), basis, axes=1)
        factor = float(np.clip((weights[:, None] * change * before).sum() / size, 0.1, 4.0))
        new = candidate.clip(candidate.nominal + factor * (value - candidate.nominal))
        if abs(new - value) < 0.03 * abs(value - candidate.nominal):
            break
        value = new
    return best


def _evidence(
    problem: Problem,
    holdout: Problem | None,
    before: Fit,
    after: Fit,
    weights: np.ndarray,
    count: int,
    config: SearchConfig,
) -> Step | None:
    """Test the newest effect in the joint fit and on held-out windows; None if it fails either."""
    newest, value = after.chosen[-1], after.values[-1]
    error = standard_errors(problem, after, weights)[-1]
    z = abs(value - newest.nominal) / max(error, 1e-300)
    p = min(1.0, 2 * norm.sf(z) * count)
    if p > config.level:
        return None
    if holdout is None:
        return Step(newest, z, p, np.nan, np.nan)
    pair = holdout.residual([before.effects, after.effects])
    nuisances = (before.nuisance, after.nuisance)
    left = [r - np.tensordot(n, holdout.nuisance, axes=1) for r, n in zip(pair, nuisances, strict=True)]
    scale = window_weights(left[0])
    power = [(r**2).mean(axis=1) * scale for r in left]
    gain = power[0] - power[1]
    spread = gain.std(ddof=1) / np.sqrt(len(gain)) if len(gain) > 1 else np.inf
    if gain.mean() < config.holdout_z * spread or gain.mean() < config.least_gain * power[0].mean():
        return None
    return Step(newest, z, p, float(power[0].mean()), float(power[1].mean()))


def _prune(problem: Problem, fit: Fit, weights: np.ndarray, bound: float) -> tuple[Fit, np.ndarray]:
    """Drop effects that the others have made needless, worst first, refitting each time."""
    while fit.chosen:
        errors = np.sqrt(np.diag(covariance(problem, fit, weights, np.arange(len(weights)))))
        nominal = np.array([c.nominal for c in fit.chosen])
        z = np.abs(fit.values - nominal) / np.maximum(errors, 1e-300)
        worst = int(np.argmin(z))
        if z[worst] >= bound:
            break
        keep = [i for i in range(len(fit.chosen)) if i != worst]
        fit = gauss_newton(problem, [fit.chosen[i] for i in keep], fit.values[keep], weights, iterations=2)
    return fit, weights
