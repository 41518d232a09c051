"""The contract's list of effects: name, place, sizes with intervals, share of the error, evidence."""

from collections.abc import Callable, Sequence
from functools import reduce
from typing import Any

import numpy as np
from scipy.stats import chi2

from bumblebee.diagnosis.candidates import INVERSE, JUDGED_ALONE, SHAPED, Candidate, Formula, experiment, label, without
from bumblebee.diagnosis.comparison import Holdout, wald
from bumblebee.diagnosis.discrepancy import Discovery
from bumblebee.diagnosis.estimation import Fit
from bumblebee.diagnosis.report.discrepancy_entries import discovered_entry
from bumblebee.diagnosis.selection import Loss, Refined, Search, alike, contact_share, rivals
from bumblebee.diagnosis.simulation import Plant, declared_values, unit_on
from bumblebee.diagnosis.thresholds.report import Effects
from bumblebee.sim.effects import CATALOGUE, Effect, is_native

_COMPARABLE = 0.25
"""Share of the change of dry friction from which on friction that changes with direction or speed is one entry with
it: a smaller one is an effect beside it, not its shape."""

SURFACE = "surface_contact"


Shares = Callable[[Sequence[Effect], Sequence[Sequence[Effect]]], Sequence[float | None]]
"""All effects, and these without one entry's each -> shares, as `shares_left_out` gives them."""


def effect_entries(
    found: Search, last: Refined, holdout: Holdout, beyond: Discovery | None, shares_of: Shares
) -> list[dict[str, Any]]:
    """The list of `diagnosis.json`, most explaining first.

    Dry friction that changes with direction or speed is one entry with the level that it sits on, `frictionloss`.
    """
    chosen = last.fit.chosen
    if not chosen:
        return []
    levels = _levels(last.fit, last.problem.thresholds.report.effects)
    groups = [[c, *([levels[c]] if c in levels else [])] for c in chosen if c not in levels.values()]
    shares = list(shares_of(last.fit.effects, [reduce(without, group, last.fit.effects) for group in groups]))
    for k, (c, *_) in enumerate(groups):
        if c.effect in JUDGED_ALONE:
            shares[k] = contact_share(last.problem, last.fit, c, holdout.problem)
    classes = dict(zip(found.fit.chosen, rivals(found, holdout, alike(found.columns, found)), strict=True))
    entries = []
    for group, share in zip(groups, shares, strict=True):
        c = group[0]
        if isinstance(c, Formula):
            i, kind = chosen.index(c), beyond.kinds[c.where] if beyond else ""
            values, half = last.fit.of(c), last.half[last.fit.slices[i]]
            z = wald(last.problem, last.fit, last.weights, i)
            entries.append(discovered_entry(c, values, half, share, z, kind))
        else:
            entries.append(_entry(found, last, group, share, [classes[each] for each in group]))
    return sorted(entries, key=lambda e: -(e["explains"] or 0.0))


def _entry(
    found: Search, last: Refined, group: Sequence[Candidate], share: float | None, classes: Sequence[list[Candidate]]
) -> dict[str, Any]:
    """The entry of a group's first, with the parameters of all."""
    first, step = group[0], {s.candidate: s for s in found.steps}[group[0]]
    others = [o for same in classes for o in same if o not in group]
    parameters: dict[str, Any] = {}
    for c in reversed(group):
        half = last.half[last.fit.slices[last.fit.chosen.index(c)]]
        parameters |= _parameters(last.problem.plant, c, last.fit.of(c), half)
        if other := last.other_laws.get(c):
            parameters = _of_both_laws(parameters, _parameters(last.problem.plant, c, other.values, other.half))
    entry = label(first) | {
        "parameters": parameters,
        "equivalent": [label(o) for o in dict.fromkeys(others)],
        "explains": share,
        "evidence": {
            "p": float(step.p),
            "test": f"Wald test in the joint fit, variance clustered by window, z = {step.z:.1f}, bound "
            f"{found.bound:.1f} for {found.count} candidates",
        },
        "native": all(is_native(c.at(last.fit.of(c))) for c in group),
    }
    if others:
        kinds = dict.fromkeys([first.effect, *(o.effect for o in others)])
        most = last.problem.thresholds.report.effects.experiments
        told = [experiment(kind, last.problem.plant.floating) for kind in kinds]
        entry["separate_by"] = [text for text in told if text][:most]
    return entry


def _levels(fit: Fit, rule: Effects) -> dict[Candidate, Candidate]:
    """Friction that changes -> the change of the same joint's dry friction that it sits on, if of comparable size.

    The largest, where a joint has two that change.
    """
    dry = {c.where: c for c in fit.chosen if c.effect == "coulomb_friction"}
    shaped = [c for c in fit.chosen if c.effect in SHAPED and c.where in dry]
    largest = {c.where: c for c in sorted(shaped, key=lambda c: abs(fit.of(c)[0]))}
    return {
        c: dry[where]
        for where, c in largest.items()
        if abs(fit.of(c)[0]) > _COMPARABLE * abs(fit.of(dry[where])[0] - dry[where].nominal[0])
    }


def _parameters(plant: Plant, c: Candidate, values: np.ndarray, half: np.ndarray) -> dict[str, Any]:
    """The contract's parameters of one effect, in its own units; `nominal` is null where the model knows no bound.

    No model declares a surface that it lacks, nor do data say which point of a body touches it.
    """
    out: dict[str, Any] = {}
    stuck = at_bounds(c, values)
    # A limit is tried from the largest torque in the data on, which is not where the model has it.
    declared = declared_values(plant, c.effect, c.where) if c.effect == "torque_limit" else c.nominal
    if c.effect == SURFACE:
        told = (c.scales > 0) & np.isfinite(half)
        declared, half = (np.inf,) * len(values), np.where(told, half, np.nan)
    kinds = CATALOGUE[c.effect].parameters
    for p, value, nominal, wide, bound in zip(kinds, values, declared, half, stuck, strict=True):
        if p.default is not None and value == p.default:
            continue
        ends = [float(value - wide), float(value + wide)]
        unit = unit_on(plant, c.effect, c.where, p.unit)
        if c.effect in INVERSE and not out:
            # The fit moves the inverse; an interval that reaches zero has no upper end.
            low, high = 1.0 / max(ends[1], 1e-12), None if ends[0] <= 0 else 1.0 / ends[0]
            out[p.name] = {"value": float(1.0 / value), "ci95": [low, high], "nominal": None, "unit": unit}
        else:
            inside = np.clip(ends, p.lower, p.upper).tolist()
            open_ends = c.effect == SURFACE and ends[0] <= p.lower and ends[1] >= p.upper
            shown = [end if np.isfinite(end) and not open_ends else None for end in inside]
            known = float(nominal) + 0.0 if np.isfinite(nominal) else None  # no -0
            out[p.name] = {"value": float(value), "ci95": shown, "nominal": known, "unit": unit}
        out[p.name] |= {"at_bound": True} if bound else {}
    return out


def at_bounds(c: Candidate, values: np.ndarray) -> np.ndarray:
    """Whether each fitted parameter (P,) has gone from the declared value as far as it may."""
    out, far = np.zeros(len(values), dtype=bool), c.scales / np.finfo(float).eps  # beyond the bounds of any parameter
    for i in np.flatnonzero((c.scales > 0) & (values != np.array(c.nominal))):
        end = values.copy()
        end[i] = np.copysign(far[i], values[i] - c.nominal[i])
        out[i] = np.isclose(c.clip(end)[i], values[i])
    return out


def _of_both_laws(own: dict[str, Any], other: dict[str, Any]) -> dict[str, Any]:
    """An effect's parameters with intervals that hold those of another law that fits as well."""
    out = {}
    for name, parameter in own.items():
        ends = [parameter["ci95"], other.get(name, parameter)["ci95"]]
        lows, highs = ([pair[k] for pair in ends] for k in (0, 1))
        low, high = None if None in lows else min(lows), None if None in highs else max(highs)
        out[name] = parameter | {"ci95": [low, high]}
    return out


def law_notes(last: Refined) -> list[str]:
    """A note for each hysteresis of which these data do not tell the law."""
    notes = []
    for c, other in last.other_laws.items():
        unit = unit_on(last.problem.plant, c.effect, c.where, "N m/rad")
        slopes = sorted(float(values[0] / values[1]) for values in (last.fit.of(c), other.values))
        notes.append(
            f"hysteresis on {c.where}: a spring that yields and Dahl's law fit these data alike, and the intervals are "
            f"those of both; what is known is the slope at a reversal, amplitude over width, {slopes[0]:.3g} to "
            f"{slopes[1]:.3g} {unit}. To tell them apart: move the joint to and fro by more than the width"
        )
    return notes


def loss_entries(loss: Loss | None) -> tuple[list[dict[str, Any]], list[Effect]]:
    """The contract's entry of lost commands, and the effect; empty for none."""
    if loss is None:
        return [], []
    entry = {
        "effect": "dropped_commands",
        "where": [loss.where] if loss.where else [],
        "parameters": {"share": {"value": loss.share, "ci95": list(loss.ci95), "nominal": 0.0, "unit": ""}},
        "equivalent": [],
        "explains": loss.explains,
        "evidence": {
            "p": float(chi2.sf(2.0 * loss.gain, 1)),
            "test": f"packet-loss log-likelihood ratio: {loss.gain:.1f} on the fitted windows, "
            + (f"{loss.paid:.1f} on the validation windows" if np.isfinite(loss.paid) else "nothing held out"),
        },
        "native": False,
    }
    return [entry], [loss.effect]
