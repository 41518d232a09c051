"""The robots that a plan must be safe on: the declared one, the diagnosed one at its intervals' ends, its rivals."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bumblebee.diagnosis.candidates import Candidate
from bumblebee.diagnosis.plan.findings import Finding, Findings
from bumblebee.diagnosis.plan.limits import Limits
from bumblebee.diagnosis.plan.machine import Machine
from bumblebee.diagnosis.thresholds.plan import Unknowns
from bumblebee.sim.effects import Effect, single


@dataclass(frozen=True, eq=False)
class Case:
    """One robot that a plan is rehearsed with."""

    name: str
    effects: Sequence[Effect]
    must: bool = True
    """Whether it must rest in the start pose; ends of intervals and rivals that cannot are not this robot."""


def cases_of(
    machine: Machine,
    limits: Limits,
    findings: Findings | None,
    rivals: Sequence[tuple[Finding, Candidate, np.ndarray]],
    rule: Unknowns,
) -> list[Case]:
    """The declared robot first, then the found one, then what is not known.

    Args:
        machine: the robot.
        limits: its limits, by which undeclared friction is sized.
        findings: of a diagnosis, if there is one.
        rivals: another explanation of a finding, with the parameters (P,) at which it imitates it.
        rule: what is taken for unknown.
    """
    cases = [Case("the declared model", [])]
    if findings is None or not findings.effects:
        cases += _undiagnosed(machine, limits, rule)
    if findings is None:
        return cases
    if findings.effects:
        cases.append(Case("the diagnosed model", findings.effects))
    for finding in findings.listed:
        rest = [e for e in findings.effects if e is not finding.found]
        for end, values in finding.ends(rule.beyond):
            if finding.differs(values, rule.same):
                cases.append(Case(f"{finding.name} at the {end}", [*rest, values], must=False))
    for finding, candidate, imitating in rivals:
        rest = [e for e in findings.effects if e is not finding.found]
        name = f"{candidate.effect} {candidate.where}".strip()
        cases.append(Case(f"{name} in the place of {finding.name}", [*rest, candidate.at(imitating)], must=False))
    return cases


def _undiagnosed(machine: Machine, limits: Limits, rule: Unknowns) -> list[Case]:
    """Stronger and weaker drives, heavier links, late commands, friction."""
    plant = machine.plant
    scalable = [name for name, s in zip(plant.joints, plant.scalable, strict=True) if s]
    driven = [j for j in range(len(plant.joints)) if machine.moved[j]]
    cases = [
        Case(f"all drives x {factor:g}", [single("motor_strength", name, factor) for name in scalable])
        for factor in rule.strength
        if scalable
    ]
    masses = [(name, float(plant.model.body(name).mass[0])) for name in plant.bodies]
    cases.append(Case(f"all masses x {rule.mass:g}", [single("link_mass", n, rule.mass * m, 1.0) for n, m in masses]))
    cases.append(
        Case(
            f"commands {1000 * rule.delay:.0f} ms late",
            [single("command_delay", plant.joints[j], rule.delay) for j in driven],
        )
    )
    rubbing = [
        single(
            "coulomb_friction",
            plant.joints[j],
            float(plant.model.dof_frictionloss[plant.dof[j]] + rule.friction * limits.torque[j]),
        )
        for j in driven
    ]
    return [*cases, Case(f"dry friction of {100 * rule.friction:.0f} % of the torque limits", rubbing)]
