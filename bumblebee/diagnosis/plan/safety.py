"""Whether simulated runs stay within the limits, and what to make smaller where they do not."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bumblebee.diagnosis.plan.contacts import Clash
from bumblebee.diagnosis.plan.machine import Machine
from bumblebee.diagnosis.plan.motions import Motion
from bumblebee.diagnosis.plan.rehearsal import Rehearsed, rehearse
from bumblebee.diagnosis.plan.stage import Stage


@dataclass(frozen=True, eq=False)
class Verdict:
    """Of one run under one case."""

    reason: str
    """Empty: the run is safe."""
    joints: np.ndarray
    """(J,) bool: joints to blame; none: all of them."""
    reached: np.ndarray
    """(3, J) shares of the limits that are reached: travel to the nearer end, speed, torque."""


def judge(stage: Stage, runs: Rehearsed, motions: Sequence[Motion]) -> list[Verdict]:
    """One verdict a run."""
    machine, limits, around = stage.machine, stage.limits, stage.around
    qpos, qvel = runs.qpos(machine.plant, machine.qpos), runs.qvel(machine.plant)
    torque = np.clip(runs.torque, -limits.torque, limits.torque)  # a run that asks for more is refused before
    # What the floor must bear of a standing robot jumps with every target.
    every = 1 if machine.plant.floating else max(1, round(around.rule.every * machine.rate))
    out = []
    for r in range(len(runs.position)):
        verdict = _by_joint(stage, runs, r, motions[r])
        if not verdict.reason and (clash := around.clash(qpos[r, ::every], qvel[r, ::every], torque[r, ::every])):
            verdict = Verdict(clash.reason, _carriers(machine, clash), verdict.reached)
        out.append(verdict)
    return out


def _by_joint(stage: Stage, runs: Rehearsed, r: int, motion: Motion) -> Verdict:
    machine, limits = stage.machine, stage.limits
    q, v, tau = runs.position[r], runs.velocity[r], runs.torque[r]
    none = np.zeros(len(machine.home), dtype=bool)
    if not (np.isfinite(q).all() and np.isfinite(v).all()):
        return Verdict("the simulation diverges", none, np.full((3, len(none)), np.inf))
    both = np.concatenate((q, motion.targets))
    room = np.where(both > machine.home, limits.high - machine.home, machine.home - limits.low)
    travel = (np.abs(both - machine.home) / np.maximum(room, 1e-9)).max(axis=0)
    reached = np.stack((travel, np.abs(v).max(axis=0) / limits.speed, np.abs(tau).max(axis=0) / limits.torque))
    broken = reached > 1.0
    if broken.any():
        kind, worst = np.unravel_index(int(np.argmax(reached)), reached.shape)
        name = ("range", "speed limit", "torque limit")[int(kind)]
        return Verdict(f"{machine.joints[int(worst)]} leaves its {name}", broken.any(axis=0), reached)
    moving = machine.moved & (np.abs(v[[0, -1]]).max(axis=0) > stage.rules.safety.still)
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


def made_safe(stage: Stage, motions: Sequence[Motion], step: float | None = None, shrinks: int | None = None) -> Safe:
    """Rehearse the motions in all cases, shrink what breaks a limit, give up what never keeps them.

    In steps of `step` [s] and at most so many `shrinks`, where these are not the stage's own.
    """
    waiting, rule = dict(enumerate(motions)), stage.rules.motions
    done: dict[int, tuple[Motion, np.ndarray]] = {}
    reason: dict[int, str] = {}
    for _ in range(1 + (rule.shrinks if shrinks is None else shrinks)):
        if not waiting:
            break
        for k, verdict in _worst(stage, waiting, stage.step if step is None else step).items():
            if verdict.reason:
                waiting[k], reason[k] = waiting[k].smaller(verdict.joints, rule.shrink), verdict.reason
            else:
                done[k] = (waiting.pop(k), verdict.reached)
    kept = [done[k] for k in sorted(done)]
    shares = np.array([reached for _, reached in kept]).reshape(len(kept), 3, len(stage.machine.home))
    return Safe([motion for motion, _ in kept], shares, Counter(reason[k] for k in waiting))


def _worst(stage: Stage, waiting: dict[int, Motion], step: float) -> dict[int, Verdict]:
    """For each motion the first verdict against it over the cases; without one, what was reached in any of them."""
    out: dict[int, Verdict] = {}
    for case in stage.cases:
        open_ = [k for k in waiting if k not in out or not out[k].reason]
        if not open_:
            break
        some = [waiting[k] for k in open_]
        runs = rehearse(stage.machine, some, case.effects, step, stage.rules.motions.settle)
        for k, new in zip(open_, judge(stage, runs, some), strict=True):
            reached = np.maximum(new.reached, out[k].reached) if k in out else new.reached
            told = f"{new.reason} ({case.name})" if new.reason else ""
            out[k] = Verdict(told, new.joints, reached)
    return out
