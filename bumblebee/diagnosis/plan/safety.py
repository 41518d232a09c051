"""Whether simulated runs stay within the limits, and what to make smaller where they do not."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from bumblebee.diagnosis.plan.contacts import Clash, Surroundings
from bumblebee.diagnosis.plan.limits import Limits
from bumblebee.diagnosis.plan.machine import Machine
from bumblebee.diagnosis.plan.motions import Motion
from bumblebee.diagnosis.plan.rehearsal import Rehearsed, rehearse
from bumblebee.diagnosis.plan.unknowns import Case
from bumblebee.diagnosis.thresholds.plan import PlanThresholds, SafetyMargins
from bumblebee.errors import BadInput
from bumblebee.sim.servo import servos_of


@dataclass(frozen=True, eq=False)
class Verdict:
    """Of one run under one case."""

    reason: str
    """Empty: the run is safe."""
    joints: np.ndarray
    """(J,) bool: joints to blame; none: all of them."""
    reached: np.ndarray
    """(3, J) shares of the limits that are reached: travel to the nearer end, speed, torque."""


def judge(
    machine: Machine, limits: Limits, around: Surroundings, runs: Rehearsed, motions: Sequence[Motion]
) -> list[Verdict]:
    """One verdict a run."""
    qpos, qvel = runs.qpos(machine.plant, machine.qpos), runs.qvel(machine.plant)
    torque = np.clip(runs.torque, -limits.torque, limits.torque)  # a run that asks for more is refused before
    # What the floor must bear of a standing robot jumps with every target.
    every = 1 if machine.plant.floating else max(1, round(around.rule.every * machine.rate))
    out = []
    for r in range(len(runs.position)):
        verdict = _by_joint(machine, limits, runs, r, motions[r], around.rule)
        if not verdict.reason and (clash := around.clash(qpos[r, ::every], qvel[r, ::every], torque[r, ::every])):
            verdict = Verdict(clash.reason, _carriers(machine, clash), verdict.reached)
        out.append(verdict)
    return out


def _by_joint(
    machine: Machine, limits: Limits, runs: Rehearsed, r: int, motion: Motion, rule: SafetyMargins
) -> Verdict:
    q, v, tau = runs.position[r], runs.velocity[r], runs.torque[r]
    none = np.zeros(len(machine.home), dtype=bool)
    if not (np.isfinite(q).all() and np.isfinite(v).all()):
        return Verdict("the simulation diverges", none, np.full((3, len(none)), np.inf))
    both = np.concatenate((q, motion.targets))
    room = np.where(both > machine.home, limits.high - machine.home, machine.home - limits.low)
    travel = (np.abs(both - machine.home) / np.maximum(room, 1e-9)).max(axis=0)
    reached = np.stack((travel, np.abs(v).max(axis=0) / limits.speed, np.abs(tau).max(axis=0) / limits.torque))
    reached[:, ~machine.moved] = 0.0
    broken = reached > 1.0
    if broken.any():
        kind, worst = np.unravel_index(int(np.argmax(reached)), reached.shape)
        name = ("range", "speed limit", "torque limit")[int(kind)]
        return Verdict(f"{machine.joints[int(worst)]} leaves its {name}", broken.any(axis=0), reached)
    moving = np.abs(v[[0, -1]]).max(axis=0) > rule.still
    if moving.any():
        return Verdict(f"{machine.joints[int(np.argmax(moving))]} is not at rest at the ends", moving, reached)
    return Verdict("", none, reached)


def _carriers(machine: Machine, clash: Clash) -> np.ndarray:
    """(J,) bool: joints that move one of the clashing bodies against the other."""
    model = machine.plant.model
    chains = []
    for body in clash.bodies:
        above = set()
        while body:
            above.add(body)
            body = int(model.body_parentid[body])
        chains.append(above)
    apart = chains[0] ^ chains[1] if len(chains) == 2 else set()
    return np.array([int(model.jnt_bodyid[model.joint(name).id]) in apart for name in machine.joints])


@dataclass(frozen=True, eq=False)
class Safe:
    """Motions that kept all limits in all cases, as far as they had to be made smaller."""

    motions: list[Motion]
    reached: np.ndarray
    """(R, 3, J) largest shares of travel, speed and torque over the cases."""
    refused: Counter[str]
    """Why others were given up -> how many."""


def made_safe(
    machine: Machine,
    limits: Limits,
    around: Surroundings,
    motions: Sequence[Motion],
    cases: Sequence[Case],
    rules: PlanThresholds,
    step: float,
    shrinks: int | None = None,
) -> Safe:
    """Rehearse the motions in all cases, shrink what breaks a limit, give up what never keeps them."""
    waiting, rule = dict(enumerate(motions)), rules.motions
    done: dict[int, tuple[Motion, np.ndarray]] = {}
    reason: dict[int, str] = {}
    for _ in range(1 + (rule.shrinks if shrinks is None else shrinks)):
        if not waiting:
            break
        verdicts = _worst(machine, limits, around, waiting, cases, rule.settle, step)
        for k, verdict in verdicts.items():
            if verdict.reason:
                waiting[k], reason[k] = waiting[k].smaller(verdict.joints, rule.shrink), verdict.reason
            else:
                done[k] = (waiting.pop(k), verdict.reached)
    kept = [done[k] for k in sorted(done)]
    shares = np.array([reached for _, reached in kept]).reshape(len(kept), 3, len(machine.home))
    return Safe([motion for motion, _ in kept], shares, Counter(reason[k] for k in waiting))


def _worst(
    machine: Machine,
    limits: Limits,
    around: Surroundings,
    waiting: dict[int, Motion],
    cases: Sequence[Case],
    settle: float,
    step: float,
) -> dict[int, Verdict]:
    """For each motion the first verdict against it over the cases; without one, what was reached in any of them."""
    out: dict[int, Verdict] = {}
    for case in cases:
        open_ = [k for k in waiting if k not in out or not out[k].reason]
        if not open_:
            break
        runs = rehearse(machine, [waiting[k] for k in open_], case.effects, step, settle)
        for k, new in zip(open_, judge(machine, limits, around, runs, [waiting[k] for k in open_]), strict=True):
            reached = np.maximum(new.reached, out[k].reached) if k in out else new.reached
            told = f"{new.reason} ({case.name})" if new.reason else ""
            out[k] = Verdict(told, new.joints, reached)
    return out


_STAND = "Choose a keyframe with --start or stronger gains, or hang the robot up and declare its base fixed."


def refuse_fallen(machine: Machine, start: Surroundings) -> None:
    """`BadInput` for a free base whose robot does not stand where it starts; `start` is around the start pose."""
    if not machine.plant.floating:
        return
    where, expected = f"{machine.name}: start pose", "a robot that stands on the floor under its servos"
    if not start.feet:
        raise BadInput(where, expected, "one that touches nothing", _STAND)
    if clash := start.clash(machine.qpos[None], np.zeros((1, machine.plant.model.nv)), _holding(machine)[None]):
        raise BadInput(where, expected, clash.reason, _STAND)


def _holding(machine: Machine) -> np.ndarray:
    """(J,) what the servos give at rest in the settled pose."""
    plant = machine.plant
    servos = servos_of(plant.model, [int(plant.model.joint(name).id) for name in machine.joints])
    still = np.zeros(len(machine.home))
    return servos.torque(machine.qpos[plant.qpos], still, machine.home * servos.gear)


def refuse_unsteady(
    machine: Machine, limits: Limits, around: Surroundings, cases: Sequence[Case], rules: PlanThresholds, step: float
) -> None:
    """`BadInput` where the robot does not even rest in the start pose within all limits, in some case."""
    ticks = max(2, round(machine.rate))
    still, ones = np.zeros((ticks, len(machine.home))), np.ones(len(machine.home))
    for gain in machine.driven:
        hold = Motion(0, "holds", "", gain, machine.home, still, ones)
        for case in cases:
            runs = rehearse(machine, [hold], case.effects, step, rules.motions.settle)
            found = judge(machine, limits, around, runs, [hold])[0].reason
            if found:
                raise BadInput(
                    f"{machine.name}: start pose, {gain}, {case.name}",
                    "a robot that rests under its servos within the limits",
                    found,
                    _STAND if machine.plant.floating else "Choose a keyframe with --start, or other limits.",
                )


def refuse_none(safe: Safe, say: Callable[[str], None]) -> None:
    """`BadInput` where no motion is safe; says what others were given up for."""
    for reason, count in safe.refused.most_common(3):
        say(f"{count} motions given up: {reason}")
    if not safe.motions:
        reason, count = safe.refused.most_common(1)[0]
        raise BadInput("plan", "a motion within all limits", f"none; {count} of them: {reason}", "Widen that limit.")
