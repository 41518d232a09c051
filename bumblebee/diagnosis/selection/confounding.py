"""Effects that these data cannot tell apart, what would separate them, and the smallest that they could have shown."""

from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from bumblebee.diagnosis.candidates import INVERSE, Candidate, is_chosen, label
from bumblebee.diagnosis.comparison import Holdout, compare, linearly_without
from bumblebee.diagnosis.estimation import Fit, gauss_newton, project, solve
from bumblebee.diagnosis.selection.forward import Search
from bumblebee.diagnosis.selection.score_tests import score_tests
from bumblebee.diagnosis.selection.told_apart import told_apart
from bumblebee.diagnosis.selection.trial import Trial, try_one
from bumblebee.diagnosis.sensitivities import Columns
from bumblebee.diagnosis.simulation import unit_on
from bumblebee.sim.effects import CATALOGUE


def alike(columns: Columns, found: Search) -> list[list[tuple[Candidate, float]]]:
    """For each chosen effect the other candidates by how much of its whitened sensitivity theirs hold, most first.

    Nuisances are taken out of both first: what they can imitate is no evidence for either.
    """
    fit, weights = found.fit, found.weights
    keep = np.isin(_keys(found.problem), _keys(found.screened))
    root = np.sqrt(weights[keep])[:, None]
    nuisance = (found.screened.nuisance * root).reshape(len(found.screened.nuisance), -1)
    basis = np.linalg.qr(nuisance.T.astype(np.float64))[0].astype(np.float32)
    flat = (columns.values * root.astype(np.float32)).reshape(len(columns.values), -1)
    flat = flat - (flat @ basis) @ basis.T
    norms = np.maximum(np.linalg.norm(flat, axis=1), 1e-12)
    unit = flat / norms[:, None]
    out = []
    moving = np.flatnonzero(fit.scales)
    for c, part in zip(fit.chosen, fit.slices, strict=True):
        away = (fit.values - np.concatenate([np.array(o.nominal) for o in fit.chosen]))[part] / np.maximum(
            fit.scales[part], 1e-300
        )
        rows = [int(np.flatnonzero(moving == part.start + f)[0]) for f in c.free]
        own = np.tensordot(away[list(c.free)], fit.columns[rows][:, keep], axes=1) * root
        own = own.ravel() - basis @ (basis.T @ own.ravel())
        own /= max(np.linalg.norm(own), 1e-12)
        cosines = unit @ own.astype(np.float32)
        shares = []
        for other, span in zip(columns.candidates, columns.slices, strict=True):
            if (other.effect, other.where) == (c.effect, c.where):
                continue
            shares.append((other, _share(unit[span], cosines[span])))
        best: dict[tuple[str, str], tuple[Candidate, float]] = {}
        for other, share in shares:
            key = (other.effect, other.where)
            if key not in best or share > best[key][1]:
                best[key] = (other, share)
        out.append(sorted(best.values(), key=lambda pair: -pair[1]))
    return out


def _share(unit: np.ndarray, cosines: np.ndarray) -> float:
    """Length of the projection of a unit vector on the span of unit rows, from their products."""
    if len(unit) == 1:
        return float(abs(cosines[0]))
    gram = (unit @ unit.T).astype(float)
    return float(np.sqrt(max(cosines @ np.linalg.pinv(gram, rcond=1e-4, hermitian=True) @ cosines, 0.0)))


def _keys(problem: Any) -> np.ndarray:
    return problem.windows.rollout.astype(np.int64) * (1 << 32) + problem.windows.start


def rivals(found: Search, holdout: Holdout, ranked: list[list[tuple[Candidate, float]]]) -> list[list[Candidate]]:
    """For each chosen effect those that these data cannot tell from it.

    Sensitivities that agree (> 0.95) are the same, unless the effect is so plain that a refit tells them apart
    (`told_apart`), or the other would have to be what it cannot: a friction below none in the place of a servo that
    damps too little. Of the next of kin the nearest are put in the effect's place in the simulator; one stays a rival
    unless it is worse by two standard errors on the windows held out from the fit (on the fitted ones where nothing is
    held out), or is told apart on all windows. Not simulated are those that by their slopes on the windows of the
    screening are worse by six, or no worse where the sensitivities agree.
    """
    fit, problem = found.fit, found.problem
    rule, judge = problem.thresholds.selection.confounding, problem.thresholds.comparison.no_worse_within_errors
    count = max(1, len(fit.chosen))
    most = min(rule.rivals, max(1, rule.all_rivals // count))
    most_same = min(rule.told_apart.rivals, max(1, rule.told_apart.all_rivals // count))
    out = []
    for i, kin in enumerate(ranked):
        same = [c for c, share in kin if share > rule.same]
        rest = linearly_without(fit, fit.chosen[i])
        free = [(c, share) for c, share in kin if share > rule.kin and not is_chosen(c, rest.chosen)]
        slopes = [_by_slopes(found, c, rest) for c, share in free if share > rule.same]
        for own in [own for own in slopes if own.beyond_bounds]:
            same.remove(own.rival)
        differ = [own for own in slopes if not own.beyond_bounds and own.worse > rule.told_apart.chi_square]
        refuted = partial(_refuted, found, holdout, rest)
        for own in differ[::-1][:most_same]:
            trial = try_one(problem, rest, own.rival, own.steps, found.weights)
            if trial is not None and refuted(trial):
                same.remove(own.rival)
        for rival in [c for c, share in free if share <= rule.same][:most]:
            own = _by_slopes(found, rival, rest)
            if own.hopeless:
                continue
            trial = try_one(problem, rest, rival, own.steps, found.weights)
            if trial is None or not compare(problem, holdout, fit, _in_place(found, rest, trial)).passes(judge):
                continue
            if own.worse < rule.told_apart.chi_square or not refuted(trial):
                same.append(rival)
        out.append(same)
    return out


@dataclass(frozen=True, eq=False)
class _Slopes:
    """Prediction for a rival in an effect's place, from the screened windows' sensitivities."""

    rival: Candidate
    steps: np.ndarray
    """(F,) at which it fits best."""
    worse: float
    """Chi-square on all fitted windows by which it fits worse than the effect."""
    hopeless: bool
    """Whether it is far worse from window to window."""

    @property
    def beyond_bounds(self) -> bool:
        """Whether it would have to go where it cannot, so that it stays where it is absent."""
        free, nominal = list(self.rival.free), np.array(self.rival.nominal)
        values = nominal.copy()
        values[free] += self.steps * np.array(self.rival.step)[free]
        return bool((self.rival.clip(values) == self.rival.clip(nominal)).all())


def _by_slopes(found: Search, rival: Candidate, rest: Fit) -> _Slopes:
    """A rival beside `rest`, linearly."""
    rule = found.problem.thresholds.selection.confounding
    small, keep = found.screened, np.isin(_keys(found.problem), _keys(found.screened))
    weights = found.weights[keep]
    columns = found.columns.only([found.columns.candidates.index(rival)])
    beside = replace(rest, residual=rest.residual[keep], columns=rest.columns[:, keep])
    basis, inverse = project(small, np.concatenate((beside.columns, columns.values)), weights)
    swapped = beside.residual - np.tensordot(solve(basis, inverse, beside.residual, weights), basis, axes=1)
    ours = found.fit.clean(found.problem)[keep]
    loss = np.log1p((swapped**2).mean(axis=1)) - np.log1p((ours**2).mean(axis=1))
    worse = float((weights[:, None] * (swapped**2 - ours**2)).sum()) * len(keep) / max(keep.sum(), 1)
    sure = rule.far_worse * loss.std(ddof=1) / np.sqrt(len(loss)) if len(loss) > rule.enough else np.inf
    return _Slopes(rival, score_tests(small, columns, beside, weights).steps[0], worse, bool(loss.mean() > sure))


def _refuted(found: Search, holdout: Holdout, rest: Fit, trial: Trial) -> bool:
    """Whether a refit tells a rival from the effect that `rest` lacks; one that cannot be fitted is not refuted."""
    decide = partial(told_apart, found.problem, holdout, found.fit, rest, trial, found.weights)
    name = f"{trial.candidate.effect} on {trial.candidate.where} in another's place"
    return found.problem.plant.failures.attempt(name, decide, lambda: False)


def _in_place(found: Search, rest: Fit, trial: Trial) -> Fit:
    """The fit with a rival; cogging is fitted in its periods, too, of which few over a short way look like a spring."""
    rival = trial.candidate
    chosen, values = (*rest.chosen, rival), np.concatenate((rest.values, trial.values))
    if rival.effect == "cogging":
        return gauss_newton(found.problem, chosen, values, found.weights, iterations=3, coarse=True, known=found.fit)
    return replace(rest, chosen=chosen, values=values, cost=np.inf)


def detectable(found: Search) -> list[dict[str, Any]]:
    """The change of each effect not found that these data would have shown, in the parameter's unit."""
    entries = []
    seen: set[tuple[str, str, str]] = set()
    chosen = {(c.effect, c.where) for c in found.fit.chosen}
    share = np.sqrt(len(found.screened.windows) / len(found.problem.windows))
    order = np.argsort([c.shape_scale for c in found.columns.candidates], kind="stable")
    for k in order:
        c = found.columns.candidates[k]
        for f, error in zip(c.free, found.tests.errors[k], strict=True):
            parameter = CATALOGUE[c.effect].parameters[f]
            key = (c.effect, c.where, parameter.name)
            if key in seen or (c.effect, c.where) in chosen or c.effect in INVERSE:
                continue
            seen.add(key)
            size = found.problem.thresholds.selection.confounding.detectable_z * share * error * abs(c.step[f])
            entries.append(
                label(c)
                | {
                    "parameter": parameter.name,
                    "change": float(size) if np.isfinite(size) else None,
                    "unit": unit_on(found.problem.plant, c.effect, c.where, parameter.unit),
                }
            )
    return entries
