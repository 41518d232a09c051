"""The document's part on what lies beyond the catalogue: entries of discovered effects, and what is unexplained.

Measured curves: the mean of a joint's missing torque over one quantity, in equally filled bins, with intervals.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import norm

from bumblebee.diagnosis.candidates import Formula
from bumblebee.diagnosis.discrepancy import BasisFunction, Discovery, JointLackOfFit, quantities_of
from bumblebee.diagnosis.report.html import share_of
from bumblebee.diagnosis.report.what_matters import LEFT
from bumblebee.diagnosis.simulation import joint_units
from bumblebee.diagnosis.thresholds.report import MeasuredCurve, ReportThresholds
from bumblebee.sim.effects import TABLE

NOT_TESTED = {"significant": False, "p": 1.0, "where": [], "depends_on": [], "description": "not tested"}
_NOWHERE = "no single joint has a significant residual torque, but the reduced chi-square is {:.2f}"


def discovered_entry(
    c: Formula, values: np.ndarray, half: np.ndarray, explains: float | None, z: float, kind: str
) -> dict[str, Any]:
    """The contract's entry of a form with `values` (P,) and half-widths (P,) of its intervals.

    `z` is that of Wald's test in the joint fit, `kind` "formula" or "curve".
    """
    terms = [
        {"term": text, "coefficient": float(v), "ci95": [float(v - h), float(v + h)] if np.isfinite(h) else None}
        for text, v, h in zip(c.texts, values, half, strict=True)
    ]
    p = float(2 * norm.sf(z))
    test = (
        f"{kind} selected among thousands of candidate terms; Wald test in the joint fit, z = {z:.1f}; lower error on "
    )
    return {
        "effect": c.effect,
        "where": [c.where],
        "parameters": {"terms": terms},
        "equivalent": [],
        "explains": explains,
        "evidence": {"p": p, "test": test + "validation windows"},
        "native": False,
    }


def unexplained(found: Discovery, rules: ReportThresholds) -> dict[str, Any]:
    """The contract's `unexplained`: what is left with all effects in force."""
    left, whole = sorted((j for j in found.left.joints if j.significant), key=lambda j: -j.excess), found.left.whole
    p = min((j.p for j in found.left.joints), default=1.0)
    said = _described(left, found, rules)
    if whole.significant and not left:
        said = _NOWHERE.format(whole.reduced_chi_square)
    return {
        "significant": bool(left) or whole.significant,
        "p": min(p, float(norm.sf(whole.z))) if whole.significant else p,
        "where": [j.joint for j in left],
        "depends_on": list(dict.fromkeys(on for j in left for on in _depends_on(j, found.unconfirmed))),
        "description": said,
    }


def _depends_on(left: JointLackOfFit, forms: Mapping[str, Mapping[str, float]]) -> tuple[str, ...]:
    """Quantities of a form that was not kept (it was sought without the joint's names, too), and of what is left."""
    return tuple(dict.fromkeys((*quantities_of(tuple(forms.get(left.joint, ()))), *left.depends_on)))


def _described(left: Sequence[JointLackOfFit], found: Discovery, rules: ReportThresholds) -> str:
    """One sentence a joint: its share of the chi-square that is left, on what it depends, and a form that was not kept.

    Of `Unexplained.joints` joints that explain enough to be proclaimed; the others are listed.
    """
    lines, forms, units = [], found.unconfirmed, joint_units(found.problem.plant)
    shares = {j.joint: explained_share(found, j).whole for j in left}
    told = sorted((j for j in left if shares[j.joint] >= rules.matters.structure), key=lambda j: -shares[j.joint])
    told, slight = told[: rules.unexplained.joints], len(left) - len(told)
    for j in told:
        on = _cut(_depends_on(j, forms), rules.matters.quantities) or "no single quantity"
        line = f"{j.joint}: residual torque depends on {on}"
        if j.functions:
            share = share_of(j.rms, max(j.typical, 1e-12), "its drive's")
            unit = units[j.joint]["torque"]
            what = "force" if unit == "N" else "torque"
            line = f"{j.joint}: a {what} of {j.rms:.2g} {unit} RMS ({share}) depends on {on}"
        if j.joint in forms:
            terms = " + ".join(f"{v:.3g}*({t})" if " " in t else f"{v:.3g}*{t}" for t, v in forms[j.joint].items())
            terms = TABLE.sub(r"curve(\1, ...)", terms)  # its points are for diagnosis.json
            line += f"; approximately {terms}, not confirmed on validation windows"
        lines.append(f"{line}; {100 * shares[j.joint]:.0f} % of {LEFT}")
    if more := len(left) - len(told) - slight:
        lines.append(f"and {more} joints more")
    if slight:
        below = f"each less than {100 * rules.matters.structure:.0f} % of {LEFT}"
        lines.append(f"{slight} {'joint' if slight == 1 else 'joints'}{' more' if lines else ''} with {below}")
    return "; ".join(lines)


def _cut(names: Sequence[str], most: int) -> str:
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(names[:most]) + more


@dataclass(frozen=True)
class ExplainedShare:
    """Explained share of what is left above the noise, in chi-square, on windows that took no part, if any."""

    whole: float
    """By the joint's laws together; without any, by a torque of its own in every fifth of every window, at most."""
    laws: tuple[float, ...]
    """By each law, the earlier ones taken out."""


def explained_share(found: Discovery, joint: JointLackOfFit) -> ExplainedShare:
    """Share of what is left that a joint's missing torque explains."""
    scene = found.left.validation or found.left.scene
    excess = max(float((scene.left**2).sum() - scene.left.size), 1e-12)
    place = found.problem.plant.joints.index(joint.joint)
    if not joint.functions:
        value, count = scene.evidence.chi_square(place)
        return ExplainedShare(_share((value - count) / excess), ())
    left, shares = scene.left, []
    for function, size in joint.functions:
        moved = scene.evidence.column(place, function.torque(scene.data, place))
        after = left - np.tensordot(size, moved, axes=1)
        shares.append(float(((left**2).sum() - (after**2).sum()) / excess))
        left = after
    return ExplainedShare(_share(sum(shares)), tuple(map(_share, shares)))


def _share(value: float) -> float:
    """Between 0 and 1; nothing where a window's residual is no number."""
    return float(np.clip(np.nan_to_num(value, nan=0.0), 0.0, 1.0))


def structure_table(found: Discovery, rule: MeasuredCurve) -> dict[str, dict[str, Any]]:
    """Joint -> what its tests said, with measured curves where there is structure, for `diagnosis.json`."""
    return {
        j.joint: {
            "p": j.p,
            "significant": j.significant,
            "excess": j.excess,
            "torque_rms": j.rms,
            "typical_torque": j.typical,
            "depends_on": list(j.depends_on),
            "laws": [_law(function, size) for function, size in j.functions],
        }
        | (_told(found, j) | {"curves": _curves(found, index, rule)} if j.significant else {})
        for index, j in enumerate(found.left.joints)
    }


def _told(found: Discovery, joint: JointLackOfFit) -> dict[str, Any]:
    """How much of what is left a joint's torque explains, and each of its laws with its quantities."""
    share = explained_share(found, joint)
    return {
        "explains": share.whole,
        "law_shares": list(share.laws),
        "law_quantities": [list(function.on) for function, _ in joint.functions],
    }


def _law(function: BasisFunction, size: np.ndarray) -> list[dict[str, Any]]:
    return [{"term": t, "coefficient": float(s)} for t, s in zip(function.texts, size, strict=True)]


def _curves(found: Discovery, joint: int, rule: MeasuredCurve) -> dict[str, list[list[float]]]:
    """Measured curves of what a joint lacks over its own quantities, by their name and unit."""
    scene = found.left.scene
    data, path, lacks = scene.data, scene.data.path, scene.evidence.lacking(joint)
    block = np.repeat(np.arange(len(lacks)), lacks.shape[1])
    over = {"velocity": data.v, "position": data.q, "torque": data.tau}
    units = joint_units(found.problem.plant)[found.left.joints[joint].joint]
    means = {f"{name} [{units[name]}]": path.mean(x[..., joint]).ravel() for name, x in over.items()} | {
        "time [s]": path.mean(data.t).ravel()
    }
    return {name: measured_curve(x, lacks.ravel(), block, rule) for name, x in means.items() if np.ptp(x) > 0}


def measured_curve(x: np.ndarray, y: np.ndarray, block: np.ndarray, rule: MeasuredCurve) -> list[list[float]]:
    """Rows [x, mean, half-width of its 95 % interval] of `y` (N,) over `x` (N,); what lies in one block counts once."""
    edges = np.unique(np.quantile(x, np.linspace(0, 1, rule.bins + 1)))
    which = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, max(len(edges) - 2, 0))
    rows = []
    for b in range(len(edges) - 1):
        mine = which == b
        blocks = len(np.unique(block[mine]))
        if mine.sum() >= rule.fewest and blocks > 1:
            half = 1.96 * float(y[mine].std()) / np.sqrt(blocks)
            rows.append([float(np.median(x[mine])), float(y[mine].mean()), float(half)])
    return rows
