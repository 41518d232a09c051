"""The document's block `summary`: what is gone, what is left in units of the task, and what is to be trusted.

Tests of significance are no part of it: on a real robot something is always left, and with enough data always
significant. What counts is how much of the error it explains.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from bumblebee.diagnosis.report.notes import told_horizon
from bumblebee.diagnosis.report.removed_error import Ends, effectors, removed
from bumblebee.diagnosis.simulation import of_joint
from bumblebee.diagnosis.thresholds.report import Matters

CARRY, BESIDE, WIDE = "carry", "beside", "wide"
"""Groups of effects: what carries the gain; what costs little to remove alone, its size known; its size not known."""
LEFT = "the remaining chi-square"
"""Note on the share that structure explains. Every reading counts by its noise there, so that a joint that errs little
may be most of it; what is left in a joint's own units is another share."""


def what_matters(document: Mapping[str, Any], ends: Ends, rule: Matters, seed: int = 0) -> dict[str, Any]:
    """The block of `diagnosis.json`.

    Args:
        document: the rest of it, with errors, effects and structure.
        ends: residuals of the windows of its error block.
        rule: thresholds.
        seed: of the bootstrap.
    """
    horizon = told_horizon(document["error"]["before"])
    gone = removed(ends, document["error"], rule, seed)
    return {
        "horizon": horizon,
        "rollouts": len(document["holdout"]),
        "removed": gone,
        "left": left_over(document["error"], horizon, document.get("units", {})),
        "ends": effectors(ends, horizon, seed)[: rule.effectors] if horizon else [],
        "structure": structure(document, rule),
        "trust": trust(document["effects"], rule),
    }


def left_over(error: Mapping[str, Any], horizon: str | None, units: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Errors left after `horizon` at each joint and the base, as RMS error, largest share first.

    `share`: of the squared error above the noise floor, over all joints of a kind, or over the base's.
    """
    if horizon is None or horizon not in error["after"]:
        return []
    after, floor = error["after"][horizon], error["floor"].get(horizon, {})
    out = []
    for joint, entry in after.get("joint_pos_rmse", {}).get("per_joint", {}).items():
        noise = floor.get("joint_pos_rmse", {}).get("per_joint", {}).get(joint, {})
        out.append(_left("joint", joint, entry, noise, of_joint({"units": units}, joint, "position")))
    for key, unit in (("base_pos_rmse", "m"), ("base_rot_rmse", "rad")):
        if key in after:
            out.append(_left("base", key.split("_")[1], after[key], floor.get(key, {}), unit))
    out = [entry for entry in out if entry["value"] is not None]
    for entry in out:
        same = [o["excess"] for o in out if (o["what"], o["unit"]) == (entry["what"], entry["unit"])]
        entry["share"] = entry["excess"] / sum(same) if sum(same) > 0 else 0.0
    ranked = sorted(out, key=lambda entry: (entry["what"] != "joint", -entry["share"]))
    return [{key: value for key, value in entry.items() if key != "excess"} for entry in ranked]


def _left(what: str, where: str, after: Mapping[str, Any], floor: Mapping[str, Any], unit: str) -> dict[str, Any]:
    value, noise = after.get("value"), floor.get("value")
    excess = max((value or 0.0) ** 2 - (noise or 0.0) ** 2, 0.0)
    out = {"what": what, "where": where, "unit": unit, "value": value, "ci95": after.get("ci95")}
    return out | {"noise": noise, "excess": excess}


def structure(document: Mapping[str, Any], rule: Matters) -> list[dict[str, Any]]:
    """Joints whose missing torque has significant structure, by the share of the chi-square left that it explains.

    `proclaimed`: whether that is enough to speak of it; `depends_on` is cut to what explains most of it.
    """
    out = []
    for joint, entry in document.get("structure", {}).items():
        if joint not in document["unexplained"]["where"]:
            continue
        share = entry.get("explains")
        out.append({
            "where": joint,
            "explains": share,
            "torque": entry["torque_rms"],
            "unit": of_joint(document, joint, "torque"),
            "depends_on": quantities(entry, rule),
            "proclaimed": share is None or share >= rule.structure,
        })  # fmt: skip
    return sorted(out, key=lambda entry: -(entry["explains"] if entry["explains"] is not None else 1.0))


def quantities(entry: Mapping[str, Any], rule: Matters) -> list[str]:
    """Quantities of a joint's missing torque: of the laws that together explain most of it, else the first few."""
    shares, names = entry.get("law_shares") or [], entry.get("law_quantities") or []
    whole = sum(max(share, 0.0) for share in shares)
    if whole <= 0:
        return list(entry["depends_on"])[: rule.quantities]
    out, told = [], 0.0
    for place in np.argsort(-np.array(shares), kind="stable"):
        if told >= rule.told * whole:
            break
        told += max(shares[place], 0.0)
        out += [name for name in names[place] if name not in out]
    return out


def trust(effects: Sequence[Mapping[str, Any]], rule: Matters) -> list[dict[str, Any]]:
    """Group and width of every effect, in the order of the list.

    `fold`: upper over lower end of the narrowest parameter; None where that includes no change, or has no end.
    `alike`: these data cannot tell it from another effect; `bound`: a parameter stands at the end of what is tried.
    """
    out = []
    for effect in effects:
        fold = _narrowest(effect)
        wide = fold is None or fold > rule.wide
        group = CARRY if (effect["explains"] or 0.0) >= rule.carries else WIDE if wide else BESIDE
        told = {"effect": effect["effect"], "where": effect["where"], "group": group}
        bound = bool(_bound(effect))
        out.append(told | {"fold": fold, "wide": wide, "alike": bool(effect["equivalent"]), "bound": bound})
    return out


def bound_warnings(effects: Sequence[Mapping[str, Any]]) -> list[str]:
    """One warning on effects with a parameter at the end of what is tried."""
    told = [
        f"{effect['effect']} on {', '.join(effect['where']) or 'the whole robot'} ({', '.join(stuck)})"
        for effect in effects
        if (stuck := _bound(effect))
    ]
    return (
        [f"at the end of the values that are tried, so it may stand for another cause: {'; '.join(told)}"]
        if told
        else []
    )


def _bound(effect: Mapping[str, Any]) -> list[str]:
    if effect["effect"] == "discovered":
        return []
    return [f"{name} {p['value']:.4g}" for name, p in effect["parameters"].items() if p.get("at_bound")]


def _narrowest(effect: Mapping[str, Any]) -> float | None:
    """Least ratio of upper to lower end among an effect's parameters; None where no interval says a size."""
    parameters = effect["parameters"]
    if effect["effect"] == "discovered":
        sizes = [(t["ci95"], 0.0) for t in parameters.get("terms", [])]
    else:
        sizes = [(p["ci95"], p["nominal"]) for p in parameters.values()]
    folds = [fold for ends, declared in sizes if (fold := _fold(ends, declared)) is not None]
    return min(folds, default=None)


def _fold(ends: Sequence[float | None] | None, declared: float | None) -> float | None:
    low, high = ends or (None, None)
    if low is None or high is None:
        return None
    if low * high <= 0 or (declared is not None and low <= declared <= high):
        return None
    return float(max(abs(low), abs(high)) / min(abs(low), abs(high)))
