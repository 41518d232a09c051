"""The next experiment: safe runs, chosen to tell apart what a diagnosis could not and to narrow what it knows."""

from collections.abc import Callable
from dataclasses import dataclass

import mujoco
import numpy as np
from threadpoolctl import threadpool_limits

from bumblebee.diagnosis.config import DiagnosisConfig
from bumblebee.diagnosis.dataset import Session
from bumblebee.diagnosis.plan.basis import Basis, basis_of
from bumblebee.diagnosis.plan.choose import choose
from bumblebee.diagnosis.plan.config import Gain, PlanConfig
from bumblebee.diagnosis.plan.contacts import Surroundings
from bumblebee.diagnosis.plan.findings import Findings
from bumblebee.diagnosis.plan.information import Lens, information_of, lens_of, logs_of
from bumblebee.diagnosis.plan.limits import Limits, limits_of
from bumblebee.diagnosis.plan.machine import Machine, make_machine
from bumblebee.diagnosis.plan.motions import FAMILIES, Motion, Scope, draw_motion
from bumblebee.diagnosis.plan.objective import Objective, imitations, objective_of
from bumblebee.diagnosis.plan.rehearsal import rehearse, settled
from bumblebee.diagnosis.plan.safety import Safe, made_safe, refuse_fallen, refuse_none, refuse_unsteady
from bumblebee.diagnosis.plan.unknowns import Case, cases_of
from bumblebee.diagnosis.simulation import Plant
from bumblebee.errors import BadInput


@dataclass(frozen=True, eq=False)
class Plan:
    """Runs to be made, and what they are expected to tell."""

    machine: Machine
    limits: Limits
    config: PlanConfig
    findings: Findings | None
    cases: list[Case]
    """The robots that it is safe on."""
    motions: list[Motion]
    """The runs."""
    reached: np.ndarray
    """(R, 3, J) largest shares of travel, speed and torque that a run reaches in any case."""
    objective: Objective
    data: np.ndarray
    """(N, N) information of what was measured already; zeros for nothing."""
    runs: np.ndarray
    """(R, N, N) information of the runs."""
    refused: dict[str, int]
    """Why other candidates were given up -> how many."""
    checked: bool
    """Whether the model has geometry by which self-collision could be looked for."""

    @property
    def basis(self) -> Basis:
        """The effects asked about."""
        return self.objective.basis


@dataclass(frozen=True, eq=False)
class Stage:
    """A robot with its limits, the cases that it must be safe in, and what motions are drawn within."""

    machine: Machine
    limits: Limits
    around: Surroundings
    cases: list[Case]
    scope: Scope
    step: float
    """Of rehearsals [s]."""


def make_plan(
    spec: mujoco.MjSpec,
    name: str,
    config: PlanConfig | None = None,
    session: Session | None = None,
    findings: Findings | None = None,
    say: Callable[[str], None] = lambda text: None,
) -> Plan:
    """Plan runs on the robot of `spec`; with the session of a dataset and what its diagnosis found, what it lacks."""
    with threadpool_limits(1, user_api="blas"):  # as in a diagnosis: many small matrices
        return _make_plan(spec, name, config or PlanConfig(), session, findings, say)


def _make_plan(
    spec: mujoco.MjSpec,
    name: str,
    config: PlanConfig,
    session: Session | None,
    findings: Findings | None,
    say: Callable[[str], None],
) -> Plan:
    """The same on the threads that there are."""
    horizon, rules = DiagnosisConfig().horizon, config.thresholds
    stage = set_stage(spec, name, config, session, findings)
    say(f"{len(stage.cases)} robots to be safe on; {config.pool} candidate motions")
    machine = stage.machine
    lens = data = objective = None
    if session is not None:
        seen = session.plant  # which knows the conditions that its rollouts were recorded under
        lens = _lens(machine, seen, session.rollouts, findings, horizon, config)
        data = information_of(seen, machine.seen_layout, session.rollouts, lens, 2 * _windows(machine, config))
        objective = _objective(machine, lens, data.sum(axis=0), config, first=data.shape[1] - _rows(lens))
        stage = _with_rivals(stage, objective, data.sum(axis=0), findings, config)
    safe = safe_pool(stage, config)
    refuse_none(safe, say)
    say(f"{len(safe.motions)} of them are safe; what they would tell")
    effects = findings.effects if findings else ()
    runs = rehearse(machine, safe.motions, effects, stage.step, rules.plan.motions.settle)
    logs = logs_of(machine, runs, safe.motions)
    if lens is None:
        lens = _lens(machine, machine.seen[Gain()], logs, findings, horizon, config)
    told = _told(machine, safe.motions, logs, lens, _windows(machine, config))
    total = data.sum(axis=0) if data is not None else np.zeros(told.shape[1:])
    if objective is None:
        objective = _objective(machine, lens, None, config, first=told.shape[1] - _rows(lens))
    return _chosen(stage, safe, objective, total, told, config, findings, say)


def set_stage(
    spec: mujoco.MjSpec, name: str, config: PlanConfig, session: Session | None, findings: Findings | None
) -> Stage:
    """The robot at rest in its start pose, where it is safe; `BadInput` where limits are unknown or it is not."""
    _refuse_config(config)
    rules = config.thresholds.plan
    machine = make_machine(spec, name, session, config)
    limits = limits_of(machine, session, config)
    small = machine.plant.model.nv <= config.thresholds.dataset.time_steps.small_model
    step = machine.steps[0] if small else machine.steps[1]
    start = Surroundings(machine.plant, machine.qpos, rules.safety)
    machine = settled(machine, step, rules.motions.settle)
    refuse_fallen(machine, start)
    around = Surroundings(machine.plant, machine.qpos, rules.safety)
    cases = cases_of(machine, limits, findings, (), rules.unknowns)
    refuse_unsteady(machine, limits, around, cases, rules, step)
    support = _supporting(machine, around)
    scope = Scope(machine.home, machine.moved, support, limits, machine.rate, config.seconds, rules.motions)
    return Stage(machine, limits, around, cases, scope, step)


def safe_pool(stage: Stage, config: PlanConfig, families: tuple[str, ...] = FAMILIES) -> Safe:
    """The candidate motions of a seed, as far as they are safe."""
    gains = config.all_gains
    motions = [
        draw_motion(stage.scope, config.seed, k, gains[(k // len(families)) % len(gains)], families)
        for k in range(config.pool)
    ]
    return made_safe(
        stage.machine, stage.limits, stage.around, motions, stage.cases, config.thresholds.plan, stage.step
    )


def _refuse_config(config: PlanConfig) -> None:
    rule = config.thresholds.plan.motions
    least = rule.lead + 2 * rule.ramp + rule.rest + 1.0
    if not least <= config.seconds <= 600:
        raise BadInput("--seconds", f"{least:g} to 600: rests, ramps and a second between them", f"{config.seconds:g}")
    every = (*config.gains, *config.damping)
    if not config.gains or any(not 0.05 <= g <= 20 for g in every):
        came = ", ".join(f"{g:g}" for g in every) or "none"
        raise BadInput("--gains, --damping", "factors from 0.05 to 20", came)
    if config.rate is not None and not 5 <= config.rate <= 5000:
        raise BadInput("--rate", "5 to 5000 Hz", f"{config.rate:g}")


def _lens(
    machine: Machine, seen: Plant, rollouts: list, findings: Findings | None, horizon: float, config: PlanConfig
) -> Lens:
    basis = basis_of(seen, rollouts, findings, config.thresholds)
    return lens_of(machine, seen, rollouts, basis, horizon, config.thresholds)


def _rows(lens: Lens) -> int:
    return lens.basis.slices[-1].stop


def _objective(machine: Machine, lens: Lens, data: np.ndarray | None, config: PlanConfig, first: int) -> Objective:
    model = machine.plant.model
    bodies = {
        name: model.body(int(model.jnt_bodyid[model.joint(name).id])).name
        for name, moved in zip(machine.joints, machine.moved, strict=True)
        if moved
    }
    return objective_of(lens.basis, first, data, bodies, config.thresholds.plan)


def _with_rivals(
    stage: Stage, objective: Objective, data: np.ndarray, findings: Findings | None, config: PlanConfig
) -> Stage:
    """The stage with the rivals' robots among its cases, at the size at which each imitates what was found."""
    rule, basis = config.thresholds.plan.unknowns, objective.basis
    rivals, count = [], dict.fromkeys(basis.found, 0)
    for (k, other), steps in imitations(objective, data).items():
        if count[k] < rule.rivals:
            c = basis.candidates[other]
            values = c.start
            for f, step in zip(c.free, steps, strict=True):
                values[f] = c.nominal[f] + step * c.step[f]
            rivals.append((basis.found[k], c, c.clip(values)))
            count[k] += 1
    cases = cases_of(stage.machine, stage.limits, findings, rivals, rule)
    return Stage(stage.machine, stage.limits, stage.around, cases, stage.scope, stage.step)


def _windows(machine: Machine, config: PlanConfig) -> int:
    """Windows that stand for a run."""
    rule, small = config.thresholds.plan.information, config.thresholds.dataset.time_steps.small_model
    return rule.windows if machine.plant.model.nv <= small else rule.few


def _told(machine: Machine, motions: list[Motion], logs: list, lens: Lens, budget: int) -> np.ndarray:
    """Information (R, N, N) of the motions, each by the robot at its gain."""
    out: list[np.ndarray | None] = [None] * len(motions)
    for gain in dict.fromkeys(m.gain for m in motions):
        some = [i for i, m in enumerate(motions) if m.gain == gain]
        told = information_of(machine.seen[gain], machine.seen_layout, [logs[i] for i in some], lens, budget)
        for i, own in zip(some, told, strict=True):
            out[i] = own
    return np.stack([own for own in out if own is not None])


def _chosen(
    stage: Stage,
    safe: Safe,
    objective: Objective,
    data: np.ndarray,
    told: np.ndarray,
    config: PlanConfig,
    findings: Findings | None,
    say: Callable[[str], None],
) -> Plan:
    """The best runs that are safe in fine steps, too; a run that is not is left out and the choice made again."""
    shut: list[int] = []
    while True:
        picked = choose(objective, data, told, config.runs, shut)
        if not picked:
            raise BadInput(
                "plan", "a motion that is safe in fine steps", "none", "Ask for smaller --travel or --speed."
            )
        some = [safe.motions[r] for r in picked]
        fine = stage.machine.steps[0]
        if fine == stage.step:
            reached = safe.reached[picked]
            break
        say("the chosen runs again, in fine steps")
        again = made_safe(
            stage.machine, stage.limits, stage.around, some, stage.cases, config.thresholds.plan, fine, shrinks=0
        )
        if len(again.motions) == len(some):
            reached = again.reached
            break
        kept = {m.number for m in again.motions}
        shut += [r for r in picked if safe.motions[r].number not in kept]
    return Plan(
        stage.machine, stage.limits, config, findings, stage.cases, some, reached, objective, data, told[picked],
        dict(safe.refused), stage.around.has_geometry,
    )  # fmt: skip


def _supporting(machine: Machine, around: Surroundings) -> np.ndarray:
    """(J,) bool: joints between a standing base and the world that its feet touch."""
    model = machine.plant.model
    below = set()
    for foot in around.feet:
        body = int(foot)
        while body:
            below.add(body)
            body = int(model.body_parentid[body])
    return np.array([int(model.jnt_bodyid[model.joint(name).id]) in below for name in machine.joints])
