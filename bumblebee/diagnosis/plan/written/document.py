"""`plan.json`: what the plan is, within which limits, and what each run is expected to tell."""

from typing import Any

import numpy as np

from bumblebee.diagnosis.plan.config import Gain
from bumblebee.diagnosis.plan.plan import Plan
from bumblebee.diagnosis.plan.predicted import classes, intervals, narrows, pairs, separates, usual, words_of
from bumblebee.diagnosis.plan.safety import LATE
from bumblebee.diagnosis.simulation import joint_units


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
        "left_out": dict(plan.left_out),
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
        "separates": separates(plan, k),
        "narrows": narrows(plan, k),
    }


def notes(plan: Plan) -> list[str]:
    """Notes beside the numbers."""
    out = [
        "chi-squares and widths are expected values for the noise given here, if all runs are logged whole and the "
        "robot is one of those it was rehearsed on"
    ]
    if not plan.checked:
        out.append("the model has no geometry that can touch: look for collisions yourself, at low speed first")
    if late := plan.refused.get(LATE):
        out.append(f"{late} of {plan.config.pool} candidates were not looked at: the time was over")
    out += [f"no run at {gain}: {reason}" for gain, reason in plan.restless.items()]
    out += _left_out(plan)
    if plan.basis.unasked:
        names = ", ".join(plan.basis.unasked)
        out.append(f"no candidate of this model stands for what was found, and the plan does not ask about it: {names}")
    open_ = [row for row in classes(plan) if row["class"] in {f.name for f in plan.basis.found.values()}]
    left = [
        " and ".join(sorted((words_of(r["if"]), words_of(r["not"]))))
        for r in pairs(open_)
        if not r["resolved"]["after"]
    ]
    if left:
        more = "; ..." if len(left) > 6 else ""
        out.append(
            f"these runs are not expected to tell apart: {'; '.join(left[:6])}{more}. "
            "Other limits (--speed, --travel), "
            "other gains (--gains, --damping) or another experiment may: `separate_by` in diagnosis.json"
        )
    return out


def _left_out(plan: Plan) -> list[str]:
    """A note for each reason; `left_out` of the document names all robots."""
    most, out = plan.config.thresholds.plan.unknowns.named, []
    for reason in dict.fromkeys(plan.left_out.values()):
        names = [name for name, why in plan.left_out.items() if why == reason]
        more = f" and {len(names) - most} more" if len(names) > most else ""
        out.append(
            f"not rehearsed on {', '.join(names[:most])}{more}: {'each ' if more or names[1:] else 'it '}{reason}"
        )
    return out


def _plain(values: np.ndarray) -> list[float]:
    return [float(v) for v in values]


def _end(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
