"""A plant for every condition that rollouts were recorded under."""

from collections.abc import Sequence
from dataclasses import replace

import mujoco
import numpy as np

from bumblebee.diagnosis.simulation.conditions import (
    Condition,
    Declared,
    condition_of,
    declared_gains,
    nominal_voltage,
    refuse_unmade,
    with_all_loads,
    with_loads,
)
from bumblebee.diagnosis.simulation.plant import Plant, make_plant
from bumblebee.diagnosis.thresholds.simulation import SimulationThresholds
from bumblebee.errors import BadInput
from bumblebee.measured.conditions import AddedMass
from bumblebee.measured.rollout import Rollout

Failed = list[tuple[str, BadInput]]
"""(rollout, why it cannot be simulated)."""


def make_plants(
    spec: mujoco.MjSpec, rollouts: Sequence[Rollout], where: object, thresholds: SimulationThresholds | None = None
) -> tuple[Plant, Failed]:
    """The plant under the first rollout's condition, with the others in `others`; `where` names the model in errors.

    Rollouts whose condition the model cannot have are named with the reason.
    """
    rules = thresholds or SimulationThresholds()
    plain = _plain(spec, rollouts, where, rules)
    stated, failed = _conditions(spec, plain, rollouts, where)
    if not stated:
        raise failed[0][1]
    kept = [r for r in rollouts if r.rollout_id in stated]
    distinct: list[tuple[Condition, Rollout]] = []
    under: dict[str, int] = {}
    for rollout, condition in zip(kept, with_all_loads([stated[r.rollout_id] for r in kept]), strict=True):
        number = next((k for k, (c, _) in enumerate(distinct) if c.like(condition, rules.conditions.relative)), None)
        if number is None and len(distinct) == rules.conditions.most:
            failed.append((rollout.rollout_id, _too_many(rollout, rules.conditions.most)))
            continue
        if number is None:
            number = len(distinct)
            distinct.append((condition, rollout))
        under[rollout.rollout_id] = number
    if len(distinct) == 1 and distinct[0][0] == Condition():
        return plain, failed
    first, *others = (make_plant(spec, _with_gains(r, c), where, rules, c) for c, r in distinct)
    return replace(first, others=tuple(others), under=under), failed


def _plain(spec: mujoco.MjSpec, rollouts: Sequence[Rollout], where: object, rules: SimulationThresholds) -> Plant:
    """The plant by the first rollout; of motors that follow targets by the first that states their gains."""
    states = next((r for r in rollouts if _has_gains(r)), rollouts[0])
    try:
        return make_plant(spec, rollouts[0], where, rules)
    except BadInput:
        if states is rollouts[0]:
            raise
        return make_plant(spec, states, where, rules)


def _conditions(
    spec: mujoco.MjSpec, plain: Plant, rollouts: Sequence[Rollout], where: object
) -> tuple[dict[str, Condition], Failed]:
    """Rollout -> its condition; and which cannot be had."""
    settable = plain.scalable & (not plain.torque_input)
    gains = declared_gains(spec, plain.joints)
    relative = plain.thresholds.conditions.relative
    declared = Declared(gains, settable, nominal_voltage(plain.model), relative)
    known = {r.rollout_id: condition_of(r, declared) for r in rollouts}
    failed = _unknown_loads(spec, known, where)
    if (settable & np.isnan(gains[0])).any():
        lacking = [r.rollout_id for r in rollouts if not _has_gains(r)]
        given = [Condition(c.kp, c.kd) for name, c in known.items() if name not in lacking]
        for name in lacking:
            if all(c.like(given[0], relative) for c in given):
                known[name] = replace(known[name], kp=given[0].kp, kd=given[0].kd)
            else:
                failed.append((name, _unstated(name, where)))
    gone = {name for name, _ in failed}
    return {name: c for name, c in known.items() if name not in gone}, failed


def _unknown_loads(spec: mujoco.MjSpec, known: dict[str, Condition], where: object) -> Failed:
    """Rollouts with a mass on a body that is not there, or that cannot carry one."""
    tried: dict[tuple[AddedMass, ...], BadInput | None] = {(): None}
    for condition in known.values():
        if condition.loads not in tried:
            tried[condition.loads] = _refusal(spec, condition.loads, where)
    return [(name, error) for name, c in known.items() if (error := tried[c.loads]) is not None]


def _refusal(spec: mujoco.MjSpec, loads: tuple[AddedMass, ...], where: object) -> BadInput | None:
    try:
        refuse_unmade(with_loads(spec, loads, where).compile(), loads, where)
    except BadInput as error:
        return error
    return None


def _has_gains(rollout: Rollout) -> bool:
    return rollout.meta.get("kp") is not None and rollout.meta.get("kd") is not None


def _with_gains(rollout: Rollout, condition: Condition) -> Rollout:
    """The rollout with the gains of its condition in its metadata, where these are not the declared ones."""
    gains = {key: list(values) for key, values in (("kp", condition.kp), ("kd", condition.kd)) if values}
    return replace(rollout, meta=rollout.meta | gains)


def _unstated(name: str, where: object) -> BadInput:
    return BadInput(
        f"{name}: metadata: kp, kd",
        f"the gains that were in force, for the motors of {where}",
        "none, and the other rollouts state several",
        "State kp and kd in its metadata.",
    )


def _too_many(rollout: Rollout, most: int) -> BadInput:
    return BadInput(
        f"{rollout.rollout_id}: metadata: kp, kd, conditions",
        f"at most {most} different conditions that change the model",
        "one more",
        "Diagnose fewer of them together.",
    )
