"""The next experiment: safe runs, chosen to tell apart what a diagnosis could not and to narrow what it knows."""

import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import mujoco
import numpy as np
from threadpoolctl import threadpool_limits

from bumblebee.diagnosis.config import DiagnosisConfig
from bumblebee.diagnosis.dataset import Session
from bumblebee.diagnosis.plan.basis import Basis, basis_of
from bumblebee.diagnosis.plan.choose import choose
from bumblebee.diagnosis.plan.config import Gain, PlanConfig
from bumblebee.diagnosis.plan.findings import Findings
from bumblebee.diagnosis.plan.information import Lens, information_of, lens_of, logs_of
from bumblebee.diagnosis.plan.limits import Limits
from bumblebee.diagnosis.plan.machine import Machine
from bumblebee.diagnosis.plan.motions import FAMILIES, Motion
from bumblebee.diagnosis.plan.objective import Objective, imitations, objective_of
from bumblebee.diagnosis.plan.plausible import implausible
from bumblebee.diagnosis.plan.pool import candidates, refuse_none, resting, set_stage, surest
from bumblebee.diagnosis.plan.rehearsal import rehearse
from bumblebee.diagnosis.plan.safety import LATE, Safe, made_safe, proven
from bumblebee.diagnosis.plan.stage import Stage
from bumblebee.diagnosis.plan.unknowns import Case, cases_of
from bumblebee.diagnosis.simulation import Plant, Stop
from bumblebee.measured.rollout import Rollout
from bumblebee.sim.effects import Effect


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
    left_out: Mapping[str, str]
    """Robots that the runs are not rehearsed on, and why."""
    restless: Mapping[str, str]
    """Gains at which no run is made since the robot does not rest, and why."""

    @property
    def basis(self) -> Basis:
        """The effects asked about."""
        return self.objective.basis


def make_plan(
    spec: mujoco.MjSpec,
    name: str,
    config: PlanConfig | None = None,
    session: Session | None = None,
    findings: Findings | None = None,
    say: Callable[[str], None] = lambda text: None,
    stop: Stop | None = None,
) -> Plan:
    """Plan runs on the robot of `spec`; with the session of a dataset and what its diagnosis found, what it lacks.

    Where `stop` limits the time, as many of the candidates are looked at as it leaves.
    """
    with threadpool_limits(1, user_api="blas"):  # as in a diagnosis: many small matrices
        return _make_plan(spec, name, config or PlanConfig(), session, findings, say, stop or Stop())


@dataclass(frozen=True, eq=False)
class _Known:
    """Prior information of the data, and how more of it is valued."""

    lens: Lens
    objective: Objective
    data: np.ndarray
    """(N, N) information; zeros for nothing."""


def _make_plan(
    spec: mujoco.MjSpec,
    name: str,
    config: PlanConfig,
    session: Session | None,
    findings: Findings | None,
    say: Callable[[str], None],
    stop: Stop,
) -> Plan:
    """Make a plan on the threads that there are."""
    stage = set_stage(spec, name, config, session, findings)
    known: _Known | None = None
    if session is not None:
        known = _measured(stage.machine, session, findings, config)
        stage = _with_rivals(stage, session, known, findings, config)
    ask = _Asking(stage, findings.effects if findings else (), _windows(stage.machine, config))
    safe, told, known = _looked_at(ask, known, config, say, stop)
    return _chosen(ask, safe, known, told, (config, findings), say, stop)


def _looked_at(
    ask: "_Asking", known: _Known | None, config: PlanConfig, say: Callable[[str], None], stop: Stop
) -> tuple[Safe, np.ndarray, _Known]:
    """The candidates that are safe, and the information (R, N, N) of each; all at once where nothing limits the time.

    Else one of each family after the other, until what is left of the time is what rehearsing the chosen ones takes.
    """
    stage, motions = ask.stage, candidates(ask.stage, config)
    size = config.pool if np.isinf(stop.minutes) else len(FAMILIES)
    safe, told, began = Safe([], np.zeros((0, 3, len(stage.machine.home))), Counter()), [], time.monotonic()
    say(f"simulating {config.pool} candidate motions")
    for first in range(0, config.pool, size):
        part = made_safe(surest(stage), motions[first : first + size])
        safe = safe.and_(part)
        if part.motions:
            logs = ask.logs(part.motions)
            known = known or _unmeasured(stage.machine, logs, config)
            told.append(ask.told(part.motions, known.lens, logs))
        stop.searching, seen = bool(safe.motions), first + size
        each = (time.monotonic() - began) / seen
        ahead = each * (size + _rehearsals(stage, config)) + _choosing(known, told, config.runs)
        if seen < config.pool and stop.before(ahead):
            safe.refused[LATE] += config.pool - seen
            break
        if seen < config.pool:
            say(f"{seen} of {config.pool} candidates were looked at, {len(safe.motions)} of them are safe")
    refuse_none(safe, say)
    assert known is not None
    say(f"{len(safe.motions)} of them are safe, with their information")
    return safe, np.concatenate(told), known


def _choosing(known: _Known | None, told: Sequence[np.ndarray], runs: int) -> float:
    """Time [s] that the choice takes, before rehearsals and after them, by what one look at one candidate takes."""
    if known is None or not told:
        return 0.0
    began = time.monotonic()
    known.objective.value(known.data + told[0][0])
    return 2 * (time.monotonic() - began) * sum(map(len, told)) * runs * (1 + known.objective.rule.exchanges)


def _rehearsals(stage: Stage, config: PlanConfig) -> float:
    """Candidates whose time the rehearsals of the chosen runs take: on all robots, in long steps and in fine ones."""
    return config.runs * len(stage.cases) / len(surest(stage).cases) * (1.0 + stage.step / stage.machine.steps[0])


def _measured(machine: Machine, session: Session, findings: Findings | None, config: PlanConfig) -> _Known:
    """Prior information of a dataset."""
    seen = session.plant  # which knows the conditions that its rollouts were recorded under
    lens = _lens(machine, seen, session.rollouts, findings, config)
    budget = 2 * _windows(machine, config)
    data = information_of(seen, machine.seen_layout, session.rollouts, lens, budget).sum(axis=0)
    return _Known(lens, _objective(machine, lens, data, config, len(data) - lens.basis.slices[-1].stop), data)


def _unmeasured(machine: Machine, logs: Sequence[Rollout], config: PlanConfig) -> _Known:
    """Nothing yet; the sizes of signals are those of the candidate runs."""
    lens = _lens(machine, machine.seen[Gain()], logs, None, config)
    one = information_of(machine.seen[Gain()], machine.seen_layout, logs[:1], lens, 1)[0]
    objective = _objective(machine, lens, None, config, len(one) - lens.basis.slices[-1].stop)
    return _Known(lens, objective, np.zeros_like(one))


def _lens(
    machine: Machine, seen: Plant, rollouts: Sequence[Rollout], findings: Findings | None, config: PlanConfig
) -> Lens:
    basis = basis_of(seen, rollouts, findings, config.thresholds)
    return lens_of(machine, seen, rollouts, basis, DiagnosisConfig().horizon, config.thresholds)


def _objective(machine: Machine, lens: Lens, data: np.ndarray | None, config: PlanConfig, first: int) -> Objective:
    model = machine.plant.model
    bodies = {
        name: model.body(int(model.jnt_bodyid[model.joint(name).id])).name
        for name, moved in zip(machine.joints, machine.moved, strict=True)
        if moved
    }
    return objective_of(lens.basis, first, data, bodies, config.thresholds.plan)


def _with_rivals(stage: Stage, session: Session, known: _Known, findings: Findings | None, config: PlanConfig) -> Stage:
    """The stage with the rivals' robots among its cases, at the size at which each imitates what was found.

    Without those that the data speak against.
    """
    rule, basis = config.thresholds.plan.unknowns, known.lens.basis
    rivals, count = [], dict.fromkeys(basis.found, 0)
    for (k, other), steps in imitations(known.objective, known.data).items():
        if count[k] < rule.rivals:
            c = basis.candidates[other]
            values = c.start
            for f, step in zip(c.free, steps, strict=True):
                values[f] = c.nominal[f] + step * c.step[f]
            rivals.append((basis.found[k], c, c.clip(values)))
            count[k] += 1
    cases = cases_of(stage.machine, stage.limits, findings, rivals, rule)
    found = findings.effects if findings else ()
    far = implausible(stage.machine, session, cases, found, known.lens.horizon, rule) if found else []
    out = dict.fromkeys(far, "explains the data far worse than the diagnosed model")
    return resting(replace(stage, left_out=out), [case for case in cases if case.name not in out])


def _windows(machine: Machine, config: PlanConfig) -> int:
    """Windows that stand for a run."""
    rule, small = config.thresholds.plan.information, config.thresholds.dataset.time_steps.small_model
    return rule.windows if machine.plant.model.nv <= small else rule.few


@dataclass(frozen=True, eq=False)
class _Asking:
    """Expected information of motions, by simulations of them."""

    stage: Stage
    effects: Sequence[Effect]
    """Effects of the robot that is expected."""
    windows: int
    """That stand for a run."""

    def logs(self, motions: Sequence[Motion]) -> list[Rollout]:
        """Rollouts that would be recorded."""
        stage = self.stage
        runs = rehearse(stage.machine, motions, self.effects, stage.step, stage.rules.motions.settle)
        return logs_of(stage.machine, runs, motions)

    def told(self, motions: Sequence[Motion], lens: Lens, logs: Sequence[Rollout]) -> np.ndarray:
        """Information (R, N, N) of the motions, each by the robot at its gain."""
        machine = self.stage.machine
        out: dict[int, np.ndarray] = {}
        for gain in dict.fromkeys(m.gain for m in motions):
            some = [i for i, m in enumerate(motions) if m.gain == gain]
            own = [logs[i] for i in some]
            told = information_of(machine.seen[gain], machine.seen_layout, own, lens, self.windows)
            out |= dict(zip(some, told, strict=True))
        return np.stack([out[i] for i in range(len(motions))])


def _chosen(
    ask: _Asking,
    safe: Safe,
    known: _Known,
    told: np.ndarray,
    asked: tuple[PlanConfig, Findings | None],
    say: Callable[[str], None],
    stop: Stop,
) -> Plan:
    """The best runs that are safe on all robots in fine steps.

    Those that are chosen are tried on all of them; what had to be made smaller is asked again what it tells, what is
    never safe is left out, and the choice is made again until all that is chosen was tried as it is; once the time is
    over, among those that were.
    """
    config, findings = asked
    stage, motions, refused = ask.stage, list(safe.motions), safe.refused.copy()
    tried: dict[int, np.ndarray] = {}  # motion -> the shares (3, J) of the limits that it reaches
    shut: list[int] = []
    last = 0.0  # seconds of a choice with its rehearsals
    while True:
        began = time.monotonic()
        picked = choose(known.objective, known.data, told, config.runs, shut)
        if not picked:
            refuse_none(Safe([], safe.reached[:0], refused), say)
        new = [r for r in picked if r not in tried]
        if not new:
            break
        if tried and stop.before(last):
            shut += [r for r in range(len(motions)) if r not in {*tried, *shut}]
            continue
        say(f"rehearsing {len(new)} runs on each of {len(stage.cases)} robots")
        proof = proven(stage, [motions[r] for r in new])
        refused += proof.refused
        found = {m.number: (m, reached) for m, reached in zip(proof.motions, proof.reached, strict=True)}
        shut += [r for r in new if motions[r].number not in found]
        kept = [r for r in new if r not in shut]
        smaller = [r for r in kept if found[motions[r].number][0] is not motions[r]]
        for r in kept:
            motions[r], tried[r] = found[motions[r].number]
        if smaller:
            again = [motions[r] for r in smaller]
            told[smaller] = ask.told(again, known.lens, ask.logs(again))
        last = time.monotonic() - began
    return Plan(
        stage.machine, stage.limits, config, findings, stage.cases, [motions[r] for r in picked],
        np.stack([tried[r] for r in picked]), known.objective, known.data, told[picked], dict(refused),
        stage.around.has_geometry, stage.left_out, stage.restless,
    )  # fmt: skip
