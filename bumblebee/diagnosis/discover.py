"""Beyond the catalogue: what remains after the best fit, its form, and that form refitted in the simulator.

A form is found in the missing torque; whether it is real is decided as for every other effect: its coefficients are
refitted on the fitted rollouts' windows, simulated with it, and it is kept if the held-out windows are better by more
than two standard errors. What is not kept is described, never forced into a name.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.stats import norm

from bumblebee.diagnosis.curves import joint_curves
from bumblebee.diagnosis.form import Form, examine
from bumblebee.diagnosis.problem import Problem, window_weights
from bumblebee.diagnosis.session import Session
from bumblebee.diagnosis.structure import JointStructure
from bumblebee.diagnosis.torque_residual import TorqueResidual, torque_residual
from bumblebee.sim.effects import Effect

_JOINTS = 3  # joints at most that get a form
_Z = 2.0
_LEAST = 0.01  # held-out gain of log chi-square below which a form is not worth its place
_PASSES = 3
NOT_TESTED = {"significant": False, "p": 1.0, "where": [], "depends_on": [], "description": "not tested"}


@dataclass(frozen=True, eq=False)
class Discovery:
    """What lies beyond the catalogue."""

    block: dict[str, Any]
    """The contract's `unexplained`, about what is left after `effects` too."""
    entries: list[dict[str, Any]]
    """Entries of the contract's list of effects."""
    effects: list[Effect]
    """The discovered effects, to be added to those of the catalogue."""
    left: list[JointStructure]
    """Every joint with all effects in force."""
    curves: dict[str, dict[str, list[list[float]]]] = field(default_factory=dict)
    """Joint with structure -> quantity -> measured curve of what is left, see `curves.measured_curve`."""


def discover(
    session: Session, problem: Problem, holdout: Problem | None, effects: Sequence[Effect], nuisance: np.ndarray
) -> Discovery:
    """Test, name and refit what `effects` leave behind.

    Args:
        session: data and model.
        problem: fitted windows.
        holdout: windows to accept by; None for a single rollout.
        effects: the catalogue's effects that were found.
        nuisance: (B,) the fit's coefficients of numerical differences.
    """
    train, held = missing_torques(session, effects, nuisance)
    if train is None or held is None:
        block = _block([], [], [])
        block["description"] = "too few windows to look for structure"
        return Discovery(block, [], [], [])
    seen = [examine(train, held, j) for j in range(len(train.joints))]
    forms: list[Form] = []
    kept: list[Effect] = []
    entries: list[dict[str, Any]] = []
    left = [s for s, _ in seen]
    for one, _ in sorted((x for x in seen if x[0].significant), key=lambda x: (-x[0].share, x[0].joint))[:_JOINTS]:
        form = examine(train, held, train.joints.index(one.joint))[1]
        forms.append(form)
        if not form.terms:
            continue
        refitted = _refit(problem, holdout, [*effects, *kept], form, nuisance)
        if refitted is None:
            continue
        effect, entry = refitted
        kept.append(effect)
        entries.append(entry)
        train, held = missing_torques(session, [*effects, *kept], nuisance)
        if train is None or held is None:
            break
    if kept and train is not None and held is not None:
        left = [examine(train, held, j)[0] for j in range(len(train.joints))]
    curves = {}
    if train is not None:
        curves = {s.joint: joint_curves(train, train.joints.index(s.joint)) for s in left if s.significant}
    return Discovery(_block(left, forms, kept), entries, kept, left, curves)


def missing_torques(
    session: Session, effects: Sequence[Effect], nuisance: np.ndarray
) -> tuple[TorqueResidual | None, TorqueResidual | None]:
    """Missing torques of the fitted and of the accepting rollouts; of a lone one its first two thirds and the rest."""

    def lacking(ids: Sequence[int], most: int) -> TorqueResidual | None:
        plant, layout, rollouts = session.plant, session.layout, session.rollouts
        return torque_residual(plant, layout, rollouts, ids, effects, nuisance, session.sigma, session.steps, most)

    train = lacking([i for i in session.train if i not in session.accept], 4000)
    if session.accept:
        return train, lacking(session.accept, 2000)
    if train is None:
        return None, None
    late = train.t > np.quantile(train.t, 2 / 3)
    return _part(train, ~late), _part(train, late)


def _part(data: TorqueResidual, rows: np.ndarray) -> TorqueResidual:
    fixed = ("joints", "creep")
    parts = {n: getattr(data, n) for n in data.__dataclass_fields__}
    return TorqueResidual(**{n: v if n in fixed else v[rows] for n, v in parts.items()})


def _refit(
    problem: Problem, holdout: Problem | None, effects: Sequence[Effect], form: Form, nuisance: np.ndarray
) -> tuple[Effect, dict[str, Any]] | None:
    """The form's coefficients in the simulator, or None where the held-out windows are not better with it."""
    names = list(form.terms)
    values = np.array([form.terms[n] for n in names])
    scale = np.abs(values) + 1e-12
    without = _clean(problem, effects, nuisance)
    weights = window_weights(without)

    def effect(x: np.ndarray) -> Effect:
        return Effect("discovered", (form.joint,), dict(zip(names, map(float, x), strict=True)))

    def cost(left: np.ndarray) -> float:
        return float((weights[:, None] * left**2).sum())

    best, left = values, _clean(problem, [*effects, effect(values)], nuisance)
    columns = np.zeros((len(values), *left.shape))
    for _ in range(_PASSES):
        moved = [best + 0.2 * scale * row for row in np.eye(len(best))]
        columns = np.stack([(left - _clean(problem, [*effects, effect(x)], nuisance)) / 0.2 for x in moved])
        basis, inverse = inverse_normal(problem.nuisance, columns, weights)
        move = (inverse @ np.einsum("bwm,wm->b", basis, left * weights[:, None]))[len(problem.nuisance) :]
        trial = best + np.clip(move, -3, 3) * scale
        tried = _clean(problem, [*effects, effect(trial)], nuisance)
        if cost(tried) >= cost(left):
            break
        small, best, left = np.all(np.abs(move) < 0.02), trial, tried
        if small:
            break
    judged = holdout or problem
    pair = [_clean(judged, chosen, nuisance) for chosen in (effects, [*effects, effect(best)])]
    before, after = ((r**2).mean(axis=1) for r in pair)
    gain = np.log1p(before) - np.log1p(after)
    z = float(gain.mean() / (gain.std(ddof=1) / np.sqrt(len(gain)) + 1e-30))
    if z < _Z or gain.mean() < _LEAST or (holdout is None and cost(left) > cost(without)):
        return None
    half = 1.96 * np.sqrt(np.diag(_covariance(problem, columns, left, weights))) * scale
    return effect(best), _entry(form, names, best, half, gain, before, after, z)


def _clean(problem: Problem, effects: Sequence[Effect], nuisance: np.ndarray) -> np.ndarray:
    """Whitened residual (W, M) with the numerical differences taken out."""
    return problem.residual([list(effects)])[0] - np.tensordot(nuisance, problem.nuisance, axes=1)


def inverse_normal(nuisance: np.ndarray, columns: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Nuisances and columns (B, W, M), and the inverse of their normal matrix with the nuisances' prior."""
    basis = np.concatenate((nuisance, columns))
    flat = (basis * np.sqrt(weights)[:, None]).reshape(len(basis), -1)
    normal, count = flat @ flat.T, len(nuisance)
    normal[np.arange(count), np.arange(count)] += 1.0
    # A term that does nothing in these windows must not make the matrix singular.
    normal[np.arange(count, len(normal)), np.arange(count, len(normal))] += 1e-9 * np.diag(normal).max()
    return basis, np.linalg.inv(normal)


def _covariance(problem: Problem, columns: np.ndarray, left: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Sandwich covariance (B, B) of the coefficients, in units of their scales, windows as clusters."""
    basis, inverse = inverse_normal(problem.nuisance, columns, weights)
    scores = np.einsum("bwm,wm->wb", basis, left * weights[:, None])
    return (inverse @ (scores.T @ scores) @ inverse)[len(problem.nuisance) :, len(problem.nuisance) :]


def _entry(
    form: Form,
    names: Sequence[str],
    values: np.ndarray,
    half: np.ndarray,
    gain: np.ndarray,
    before: np.ndarray,
    after: np.ndarray,
    z: float,
) -> dict[str, Any]:
    terms = [
        {"term": name, "coefficient": float(value), "ci95": [float(value - h), float(value + h)]}
        for name, value, h in zip(names, values, half, strict=True)
    ]
    return {
        "effect": "discovered",
        "where": [form.joint],
        "parameters": {"terms": terms},
        "equivalent": [],
        "explains": float(np.clip(1.0 - np.median(after) / max(np.median(before), 1e-30), 0.0, 1.0)),
        "evidence": {
            "p": float(norm.sf(z)),
            "test": f"{form.kind} for the missing torque; accepting windows simulated with it: log chi-square falls by "
            f"{gain.mean():.3g}, z = {z:.1f}",
        },
        "native": False,
    }


def _block(left: Sequence[JointStructure], forms: Sequence[Form], kept: Sequence[Effect]) -> dict[str, Any]:
    """The contract's `unexplained` of what is left."""
    found = sorted((s for s in left if s.significant), key=lambda s: -s.rms / s.typical)
    named = {place for effect in kept for place in effect.where}
    return {
        "significant": bool(found),
        "p": min((s.p for s in left), default=1.0),
        "where": [s.joint for s in found],
        "depends_on": list(dict.fromkeys(d for s in found for d in s.depends_on)),
        "description": _describe(found, [f for f in forms if f.terms and f.joint not in named]),
    }


def structure_table(found: Discovery) -> dict[str, dict[str, Any]]:
    """Joint -> what its test said, with measured curves where there is structure, for `diagnosis.json`."""
    return {
        s.joint: {
            "p": s.p,
            "significant": s.significant,
            "share": s.share,
            "torque_rms": s.rms,
            "typical_torque": s.typical,
            "depends_on": list(s.depends_on),
            "ljung_box_p": s.ljung_box,
        }
        | ({"curves": found.curves[s.joint]} if s.joint in found.curves else {})
        for s in found.left
    }


def _describe(found: Sequence[JointStructure], forms: Sequence[Form]) -> str:
    """One sentence a joint: what depends on what, how much it is, and a form that the simulator did not confirm."""
    lines = []
    for s in found[:3]:
        on = ", ".join(s.depends_on) or "no single quantity"
        part = f"{s.rms:.2g} N m RMS ({100 * s.rms / s.typical:.0f} % of its drive's)"
        line = f"{s.joint}: a torque of {part} depends on {on}"
        form = next((f for f in forms if f.joint == s.joint), None)
        if form is not None:
            terms = " + ".join(f"{v:.3g}*({t})" if " " in t else f"{v:.3g}*{t}" for t, v in form.terms.items())
            line += f"; near {_shortened(terms)}, which the held-out windows did not confirm"
        lines.append(line)
    if len(found) > 3:
        lines.append(f"and {len(found) - 3} joints more")
    return "; ".join(lines)


def _shortened(text: str) -> str:
    return text if len(text) <= 100 else f"{text[:80]} ..."
