"""Prediction of a plan's outcome: chi-squares of pairs and half-widths of intervals, before and after."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from bumblebee.diagnosis.plan.objective import Question
from bumblebee.diagnosis.plan.plan import Plan
from bumblebee.diagnosis.simulation import unit_on
from bumblebee.errors import BadInput
from bumblebee.sim.effects import CATALOGUE


def _total(plan: Plan, without: int | None = None) -> np.ndarray:
    kept = [r for r in range(len(plan.runs)) if r != without]
    return plan.data + plan.runs[kept].sum(axis=0)


def classes(plan: Plan) -> list[dict[str, Any]]:
    """Each pair that the plan asks about, with the chi-square left if the one is there and the other fitted."""
    objective, total = plan.objective, _total(plan)
    rows = []
    for question in objective.questions:
        before, alone = objective.left(plan.data, question)
        after, whole = objective.left(total, question)
        rows.append(
            {
                "class": question.group,
                "if": _label(plan, question.true),
                "not": _label(plan, question.fitted),
                "chi2": {"before": before, "after": after},
                "cosine": {"before": _cosine(before, alone), "after": _cosine(after, whole)},
                "resolved": {
                    "before": objective.answered(before, alone) >= 1.0,
                    "after": objective.answered(after, whole) >= 1.0,
                },
            }
        )
    return rows


def pairs(rows: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """One row of `classes` for each two effects, the direction that is harder to tell, hardest first.

    Two effects are told apart where they are in both directions: either one if it is there and the other is fitted.
    """
    found: dict[frozenset[str], list[dict[str, Any]]] = {}
    for row in rows:
        found.setdefault(frozenset((words_of(row["if"]), words_of(row["not"]))), []).append(row)
    out = []
    for both in found.values():
        hardest = min(both, key=lambda row: (row["resolved"]["after"], row["chi2"]["after"]))
        out.append(
            hardest | {"resolved": {when: all(r["resolved"][when] for r in both) for when in hardest["resolved"]}}
        )
    return sorted(out, key=lambda row: (row["resolved"]["after"], row["chi2"]["after"]))


def refuse_idle(told: dict[str, Any]) -> None:
    """`BadInput` where effects are open and no run is expected to tell any more of them apart.

    Args:
        told: the plan's document. One that asks about no open pair is for the intervals, and passes.
    """
    asked = pairs(told["predicted"]["classes"])
    before, after = (sum(row["resolved"][when] for row in asked) for when in ("before", "after"))
    if before < len(asked) and after <= before:
        raise BadInput(
            "plan",
            "runs that tell effects apart",
            f"none within the limits: pairs told apart {before} of {len(asked)} now, {after} with all runs",
            "Nothing is written. Where the robot's kd can be set, add `--damping 0.3`.",
        )


def _cosine(left: float, alone: float) -> float | None:
    """Cosine of the angle between what is there and what the rival can do; None where the data feel neither."""
    return float(np.sqrt(max(0.0, 1.0 - left / alone))) if alone > 1e-6 else None


def intervals(plan: Plan) -> list[dict[str, Any]]:
    """Half-widths of the found effects' intervals as the diagnosis has them, and as they are predicted with the plan.

    The prediction scales the diagnosis's own width by the ratio of the expected ones.
    """
    objective = plan.objective
    before, after = objective.widths(plan.data), objective.widths(_total(plan))
    rows = []
    for k, finding in plan.basis.found.items():
        c = plan.basis.candidates[k]
        for i, f in enumerate(c.free):
            parameter = CATALOGUE[c.effect].parameters[f]
            low, high = finding.low.get(parameter.name), finding.high.get(parameter.name)
            half = None if low is None or high is None else 0.5 * (high - low)
            ratio = float(after[k][i] / before[k][i])
            rows.append(
                {
                    **_label(plan, k),
                    "parameter": parameter.name,
                    "unit": unit_on(plan.machine.plant, c.effect, c.where, parameter.unit),
                    "value": finding.found.parameters.get(parameter.name),
                    "half_width": {"before": half, "after": None if half is None else half * ratio},
                    "ratio": ratio,
                }
            )
    return rows


def usual(plan: Plan) -> dict[str, Any]:
    """Half-widths of 95 % that the plan gives to the usual effects of each joint, as fitted one joint at a time."""
    objective, basis = plan.objective, plan.basis
    before, after = objective.usual_widths(plan.data), objective.usual_widths(_total(plan))
    table, at = [], 0
    for rows in objective.blocks:
        owners = [k for k in basis.usual if np.isin(objective.rows(k), rows).all()]
        for k in owners:
            c = basis.candidates[k]
            for f in c.free:
                parameter = CATALOGUE[c.effect].parameters[f]
                size = 1.96 * abs(c.step[f])
                table.append(
                    {
                        **_label(plan, k),
                        "parameter": parameter.name,
                        "unit": unit_on(plan.machine.plant, c.effect, c.where, parameter.unit),
                        "half_width": {"before": float(size * before[at]), "after": float(size * after[at])},
                        "known": bool(after[at] < 0.5 * plan.config.thresholds.plan.information.prior),
                    }
                )
                at += 1
    return {"effects": table, "median_ratio": float(np.median(after / before))}


def separates(plan: Plan, k: int) -> list[dict[str, Any]]:
    """Pairs whose chi-square falls most without this run."""
    objective, total, less = plan.objective, _total(plan), _total(plan, k)
    rows = []
    for question in objective.questions:
        whole, rest = objective.left(total, question)[0], objective.left(less, question)[0]
        if whole > 1.0:
            rows.append((1.0 - rest / whole, whole, question))
    rows.sort(key=lambda row: -row[0])
    return [
        {"if": _label(plan, q.true), "not": _label(plan, q.fitted), "share": share, "chi2": whole}
        for share, whole, q in _each_once(rows)[:5]
        if share > 0.1
    ]


def _each_once(rows: Sequence[tuple[float, float, Question]]) -> list[tuple[float, float, Question]]:
    """First of both directions of each pair."""
    seen: set[frozenset[int]] = set()
    out = []
    for share, whole, q in rows:
        if (pair := frozenset((q.true, q.fitted))) not in seen:
            seen.add(pair)
            out.append((share, whole, q))
    return out


def narrows(plan: Plan, k: int) -> list[dict[str, Any]]:
    """Found effects whose intervals this run narrows most: their width without it over that with it."""
    objective = plan.objective
    whole, rest = objective.widths(_total(plan)), objective.widths(_total(plan, k))
    ratios = [(float((rest[i] / whole[i]).max()), i) for i in whole]
    return [
        {**_label(plan, i), "wider_without": ratio}
        for ratio, i in sorted(ratios, key=lambda r: -r[0])[:5]
        if ratio > 1.05
    ]


def words_of(label: dict[str, Any]) -> str:
    """An effect and its place."""
    return f"{label['effect'].replace('_', ' ')} {' '.join(label['where'])}".strip()


def _label(plan: Plan, k: int) -> dict[str, Any]:
    c = plan.basis.candidates[k]
    return {"effect": c.effect, "where": [c.where] if c.where else []}
