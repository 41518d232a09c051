"""`plan.json`: what the plan is, within which limits, and what each run is expected to tell."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from bumblebee.diagnosis.plan.config import Gain
from bumblebee.diagnosis.plan.objective import Question
from bumblebee.diagnosis.plan.plan import Plan
from bumblebee.diagnosis.simulation import joint_units, unit_on
from bumblebee.sim.effects import CATALOGUE


def run_names(plan: Plan) -> list[str]:
    """Names of the runs' files, without ending."""
    return [f"{k + 1:02d}" for k in range(len(plan.motions))]


def document(plan: Plan, sha256: str) -> dict[str, Any]:
    """The whole document; `sha256` is that of the runs' CSV files, one after the other."""
    machine, config = plan.machine, plan.config
    return {
        "schema": 1,
        "kind": "plan",
        "model": machine.name,
        "seed": config.seed,
        "sha256": sha256,
        "rate": machine.rate,
        "seconds": len(plan.motions[0].shape) / machine.rate,
        "joints": list(machine.joints),
        "units": joint_units(machine.plant),
        "command": _command(plan),
        "start": dict(zip(machine.joints, _plain(machine.home), strict=True)),
        "limits": _limits(plan),
        "safe_on": [case.name for case in plan.cases],
        "runs": [_run(plan, k) for k in range(len(plan.motions))],
        "predicted": {"classes": classes(plan), "intervals": intervals(plan), "usual": usual(plan)},
        "noise": dict(zip(machine.seen_layout.labels(machine.joints), _plain(machine.sigma), strict=True)),
        "refused": plan.refused,
        "notes": notes(plan),
    }


def _command(plan: Plan) -> dict[str, Any]:
    """How the targets are followed."""
    machine = plan.machine
    if not machine.tracked:
        return {"kind": "position targets", "follow": "the drives' own servos"}
    return {
        "kind": "position targets",
        "follow": "a servo beside the drives: torque = kp (target - position) - kd velocity; log it as "
        "joint_torque_cmd",
        "kp": _plain(machine.kp),
        "kd": _plain(machine.kd),
    }


def _limits(plan: Plan) -> dict[str, Any]:
    limits, rule = plan.limits, plan.config.thresholds.plan.safety
    by_joint = {
        name: {
            "low": _end(limits.low[j]),
            "high": _end(limits.high[j]),
            "speed": _end(limits.speed[j]),
            "torque": _end(limits.torque[j]),
        }
        for j, name in enumerate(plan.machine.joints)
        if plan.machine.moved[j]
    }
    return {
        "joints": by_joint,
        "from": dict(limits.said_by),
        "margins": {"travel": rule.travel, "speed": rule.speed, "torque": rule.torque, "clearance": rule.clearance},
        "self_collision": "checked" if plan.checked else "not checked: the model has no geometry that can touch",
        "stance": plan.machine.plant.floating,
    }


def _run(plan: Plan, k: int) -> dict[str, Any]:
    machine, motion = plan.machine, plan.motions[k]
    reached = plan.reached[k]
    worst = reached.argmax(axis=1)
    gains: dict[str, Any] = {}
    if motion.gain != Gain() or machine.tracked:
        gains = {"kp": _plain(motion.gain.kp * machine.kp), "kd": _plain(motion.gain.kd * machine.kd)}
    return {
        "run": run_names(plan)[k],
        "family": motion.family,
        "motion": motion.text,
        "gains": str(motion.gain),
        "factors": motion.gain._asdict(),
        **gains,
        "reached": {
            name: {"share": float(reached[i].max()), "joint": machine.joints[int(worst[i])]}
            for i, name in enumerate(("travel", "speed", "torque"))
        },
        "separates": _separates(plan, k),
        "narrows": _narrows(plan, k),
    }


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
                "resolved": {"before": before >= objective.rule.enough, "after": after >= objective.rule.enough},
            }
        )
    return rows


def _cosine(left: float, alone: float) -> float | None:
    """Of the angle between what is there and what the rival can do; None where the data feel neither."""
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


def _separates(plan: Plan, k: int) -> list[dict[str, Any]]:
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
    """Of both directions of a pair the first."""
    seen: set[frozenset[int]] = set()
    out = []
    for share, whole, q in rows:
        if (pair := frozenset((q.true, q.fitted))) not in seen:
            seen.add(pair)
            out.append((share, whole, q))
    return out


def _narrows(plan: Plan, k: int) -> list[dict[str, Any]]:
    """Found effects whose intervals this run narrows most: their width without it over that with it."""
    objective = plan.objective
    whole, rest = objective.widths(_total(plan)), objective.widths(_total(plan, k))
    ratios = [(float((rest[i] / whole[i]).max()), i) for i in whole]
    return [
        {**_label(plan, i), "wider_without": ratio}
        for ratio, i in sorted(ratios, key=lambda r: -r[0])[:5]
        if ratio > 1.05
    ]


def notes(plan: Plan) -> list[str]:
    """What to know beside the numbers."""
    out = [
        "chi-squares and widths are expected values for the noise given here, if all runs are logged whole and the "
        "robot is one of those it was rehearsed on"
    ]
    if not plan.checked:
        out.append("the model has no geometry that can touch: look for collisions yourself, at low speed first")
    for name in plan.left_out:
        out.append(f"not rehearsed on {name}: it does not even rest in the start pose")
    for name in plan.basis.unasked:
        out.append(f"{name}: no candidate of this model stands for it; the plan does not ask about it")
    open_ = [row for row in classes(plan) if row["class"] in {f.name for f in plan.basis.found.values()}]
    pairs = (sorted((words_of(r["if"]), words_of(r["not"]))) for r in open_ if not r["resolved"]["after"])
    left = list(dict.fromkeys(" and ".join(pair) for pair in pairs))
    if left:
        more = "; ..." if len(left) > 6 else ""
        out.append(
            f"these runs are not expected to tell apart: {'; '.join(left[:6])}{more}. "
            "Other limits (--speed, --travel), "
            "other gains (--gains, --damping) or another experiment may: `separate_by` in diagnosis.json"
        )
    return out


def words_of(label: dict[str, Any]) -> str:
    """An effect and its place."""
    return f"{label['effect'].replace('_', ' ')} {' '.join(label['where'])}".strip()


def _label(plan: Plan, k: int) -> dict[str, Any]:
    c = plan.basis.candidates[k]
    return {"effect": c.effect, "where": [c.where] if c.where else []}


def _plain(values: np.ndarray) -> list[float]:
    return [float(v) for v in values]


def _end(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
