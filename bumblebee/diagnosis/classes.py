"""Effects that these data cannot tell apart, what would separate them, and the smallest that they could have shown."""

from dataclasses import replace
from typing import Any

import numpy as np

from bumblebee.diagnosis.candidates import INVERSE, Candidate
from bumblebee.diagnosis.eligible import is_chosen
from bumblebee.diagnosis.fit import Fit, gauss_newton, project, solve
from bumblebee.diagnosis.holdout import Holdout
from bumblebee.diagnosis.scores import Columns, score_tests
from bumblebee.diagnosis.search import Search
from bumblebee.diagnosis.trials import Trial, try_one
from bumblebee.diagnosis.units import unit_on
from bumblebee.sim.effects import CATALOGUE

_SAME = 0.95
_KIN = 0.7  # whitened sensitivities this parallel are worth trying in each other's place
_RIVALS, _ALL_RIVALS = 4, 16  # tried in an effect's place; in all effects' places together, but one each
_FAR_WORSE, _ENOUGH = 6.0, 20  # standard errors by which slopes make a rival hopeless; windows that can say so
_POWER_Z = 4.0  # seen four times out of five at a bound of about three standard errors

# What a person would do to tell an effect from those that look the same.
EXPERIMENTS = {
    "viscous_friction": "vary kd, or command a velocity: a servo's damping follows both, a joint's does not",
    "kd": "vary kd: an error of the gain grows with it, friction does not",
    "kp": "vary kp and hold a known load",
    "motor_strength": "hold a known load at rest, and vary kp and kd together",
    "encoder_offset": "move the joint against a stop of known angle",
    "joint_spring": "move the joint slowly through its whole range, unpowered",
    "asymmetric_friction": "move the joint at the same speed both ways, with the joint's axis vertical",
    "command_delay": "command steps and log the torque",
    "torque_lag": "command steps and log the torque at 500 Hz",
    "encoder_delay": "film the joint, or log a second encoder",
    "dropped_commands": "log the commands as the drive receives them",
    "coulomb_friction": "move at several speeds under several loads",
    "stribeck_friction": "creep through zero speed",
    "load_dependent_friction": "move at the same speed under two loads",
    "hysteresis": "move to and fro by small angles",
    "armature": "accelerate the joint with the link taken off or with a known weight on it",
    "link_mass": "add 2 kg to the link, or weigh it",
    "link_com": "hold the link still in several poses and log the torque",
    "link_inertia": "swing the link fast about each axis",
    "external_wrench": "unplug what is tethered, and repeat in another heading",
    "ground_slope": "turn the robot by 180 degrees on the spot",
    "imu_offset": "turn the robot by 180 degrees on the spot, on a levelled floor",
    "ground_friction": "push a standing robot sideways until it slips",
    "ground_compliance": "drop the robot's foot on the floor",
    "torque_limit": "hold a growing load",
    "torque_speed_limit": "move fast without load and slowly under load",
    "thermal_fade": "repeat the motion after a pause",
    "strength_drift": "repeat the motion after a pause, without one",
    "cogging": "turn the unpowered joint slowly",
    "backlash": "rock the joint with the motor held",
    "series_elasticity": "load the joint with the motor held",
    "encoder_quantisation": "log at rest",
}


def label(c: Candidate) -> dict[str, Any]:
    """How the contract names a candidate."""
    return {"effect": c.effect, "where": [c.where] if c.where else []}


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
    """For each chosen effect those that fit the held-out windows no worse in its place.

    Sensitivities that agree (> 0.95) are the same to these data. Of the next of kin the nearest are put in the effect's
    place in the simulator; one stays a rival unless it is worse by two standard errors on the windows held out from the
    fit (on the fitted ones where nothing is held out), or fits the fitted ones better. Not simulated are those that by
    their slopes are worse by six on the windows of the screening.
    """
    fit, problem = found.fit, found.problem
    most = min(_RIVALS, max(1, _ALL_RIVALS // max(1, len(fit.chosen))))
    out = []
    for i, kin in enumerate(ranked):
        same = [c for c, share in kin if share > _SAME]
        rest = _less(fit, i)
        near = [c for c, share in kin if _KIN < share <= _SAME and not is_chosen(c, rest.chosen)][:most]
        for rival in near:
            steps = _direction(found, rival, rest)
            if steps is None:
                continue
            trial = try_one(problem, rest, rival, steps, found.weights)
            if trial is not None and _no_worse(found, holdout, _in_place(found, rest, trial)):
                same.append(rival)
        out.append(same)
    return out


def _direction(found: Search, rival: Candidate, rest: Fit) -> np.ndarray | None:
    """The steps (F,) that the screened windows suggest for a rival beside `rest`; None where it is far worse there."""
    small, keep = found.screened, np.isin(_keys(found.problem), _keys(found.screened))
    weights = found.weights[keep]
    columns = found.columns.only([found.columns.candidates.index(rival)])
    beside = replace(rest, residual=rest.residual[keep], columns=rest.columns[:, keep])
    basis, inverse = project(small, np.concatenate((beside.columns, columns.values)), weights)
    swapped = beside.residual - np.tensordot(solve(basis, inverse, beside.residual, weights), basis, axes=1)
    ours = found.fit.clean(found.problem)[keep]
    loss = np.log1p((swapped**2).mean(axis=1)) - np.log1p((ours**2).mean(axis=1))
    if len(loss) > _ENOUGH and loss.mean() > _FAR_WORSE * loss.std(ddof=1) / np.sqrt(len(loss)):
        return None
    return score_tests(small, columns, beside, weights).steps[0]


def _less(fit: Fit, index: int) -> Fit:
    """The fit less one effect: its residual grows by that effect's linear part."""
    part = fit.slices[index]
    moving = np.flatnonzero(fit.scales)
    rows = [k for k, m in enumerate(moving) if part.start <= m < part.stop]
    candidate = fit.chosen[index]
    away = fit.values[part] - np.array(candidate.nominal)
    linear = [away[moving[k] - part.start] / fit.scales[moving[k]] for k in rows]
    free = [moving[k] - part.start in candidate.free for k in rows]
    grown = sum((a * fit.columns[k] for a, k, f in zip(linear, rows, free, strict=True) if f), np.zeros(1))
    keep = [k for k in range(len(moving)) if k not in rows]
    others = [i for i in range(len(fit.values)) if not part.start <= i < part.stop]
    return replace(
        fit,
        chosen=tuple(c for k, c in enumerate(fit.chosen) if k != index),
        values=fit.values[others],
        residual=fit.residual + grown,
        columns=fit.columns[keep],
    )


def _in_place(found: Search, rest: Fit, trial: Trial) -> Fit:
    """The fit with a rival; cogging is fitted in its periods, too, of which few over a short way look like a spring."""
    rival = trial.candidate
    chosen, values = (*rest.chosen, rival), np.concatenate((rest.values, trial.values))
    if rival.effect == "cogging":
        return gauss_newton(found.problem, chosen, values, found.weights, iterations=3, coarse=True, known=found.fit)
    return replace(rest, chosen=chosen, values=values, cost=np.inf)


def _no_worse(found: Search, holdout: Holdout, swapped: Fit) -> bool:
    """Whether the fit with a rival in an effect's place is not worse beyond two standard errors, or even better."""
    if swapped.cost < found.fit.cost:
        return True
    if holdout.problem is not None:
        logs = holdout.logs([found.fit, swapped])
    else:
        raw = found.problem.residual([found.fit.effects, swapped.effects])
        left = raw - np.tensordot(found.fit.nuisance, found.problem.nuisance, axes=1)
        logs = np.log1p((left**2).mean(axis=2))
    loss = logs[1] - logs[0]
    return bool(loss.mean() < 2.0 * loss.std(ddof=1) / np.sqrt(len(loss)))


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
            size = _POWER_Z * share * error * abs(c.step[f])
            entries.append(
                label(c)
                | {
                    "parameter": parameter.name,
                    "change": float(size) if np.isfinite(size) else None,
                    "unit": unit_on(found.problem.plant, c.effect, c.where, parameter.unit),
                }
            )
    return entries
