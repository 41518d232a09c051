"""Where motions are rehearsed: the robot at rest, its limits, and the robots that a plan must be safe on."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from bumblebee.diagnosis.plan.contacts import Surroundings
from bumblebee.diagnosis.plan.limits import Limits
from bumblebee.diagnosis.plan.machine import Machine
from bumblebee.diagnosis.plan.motions import Scope
from bumblebee.diagnosis.plan.unknowns import Case
from bumblebee.diagnosis.thresholds.plan import PlanThresholds


@dataclass(frozen=True, eq=False)
class Stage:
    """A robot with its limits, the cases that it must be safe in, and what motions are drawn within."""

    machine: Machine
    limits: Limits
    around: Surroundings
    cases: list[Case]
    scope: Scope
    step: float
    """Time step of rehearsals [s]."""
    rules: PlanThresholds
    left_out: Mapping[str, str] = field(default_factory=dict)
    """Cases that a plan is not rehearsed on, and why."""
    restless: Mapping[str, str] = field(default_factory=dict)
    """Gains at which the robot does not rest in the start pose, so that no run is made at them, and why."""
