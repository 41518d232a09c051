"""Whether simulated runs stay within the limits, and what to make smaller where they do not."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bumblebee.diagnosis.plan.contacts import Clash
from bumblebee.diagnosis.plan.machine import Machine
from bumblebee.diagnosis.plan.motions import Motion
from bumblebee.diagnosis.plan.rehearsal import Rehearsed, rehearse
from bumblebee.diagnosis.plan.stage import Stage
from bumblebee.diagnosis.plan.unknowns import Case
from bumblebee.diagnosis.simulation import vary

LATE = "not looked at: the time was over"
"""Why a candidate was given up where the time is limited."""


@dataclass(frozen=True, eq=False)
class Verdict:
    """Verdict on one run under one case."""

    reason: str
    """Empty: the run is safe."""
    joints: np.ndarray
    """(J,) bool: joints to blame; none: all of them."""
    reached: np.ndarray
    """(3, J) shares of the limits that are reached: travel to the nearer end, speed, torque."""


def judge(stage: Stage, runs: Rehearsed, motions: Sequence[Motion]) -> list[Verdict]:
    """One verdict a run, by what is seen at its ticks or between them."""
    machine, limits, around = stage.machine, stage.limits, stage.around
    qpos, qvel = runs.qpos(machine.plant, machine.qpos), runs.qvel(machine.plant)
    torque = np.clip(runs.torque, -limits.torque, limits.torque)  # a run that asks for more is refused before
    each = (runs.position.shape[1] - 1) // (len(motions[0].shape) - 1)
    every = max(1, round(around.rule.every * machine.rate * each))
    if machine.plant.floating:  # what the floor must bear of a standing robot jumps with every target
        every = min(every, each)
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
        return Verdict(f"{machine.joints[int(worst)]} leaves its {name}", np.any(broken, axis=0), reached)
    moving = machine.moved & (np.abs(v[[0, -1]]).max(axis=0) > stage.rules.safety.still)
    if moving.any():
        return Verdict(f"{machine.joints[int(np.argmax(moving))]} is not at rest at the ends", moving, reached)
    return Verdict("", none, reached)


def _carriers(machine: Machine, clash: Clash) -> np.ndarray:
    """(J,) bool: joints that move one of the clashing bodies against the other, or against the world."""
    model = machine.plant.model
    chains = []
    for body in clash.bodies:
        above = set()
        while body:
            above.add(body)
            body = int(model.body_parentid[body])
        chains.append(above)
    apart = set[int]()
    for chain in chains:
        apart ^= chain
    return np.array([int(model.jnt_bodyid[model.joint(name).id]) in apart for name in machine.joints])


@dataclass(frozen=True, eq=False)
class Safe:
    """Motions that kept all limits in all cases, as far as they had to be made smaller."""

    motions: list[Motion]
    reached: np.ndarray
    """(R, 3, J) largest shares of travel, speed and torque over the cases."""
    refused: Counter[str]
    """Why others were given up -> how many."""

    def and_(self, more: "Safe") -> "Safe":
        """Together with others."""
        shares = np.concatenate((self.reached, more.reached))
        return Safe([*self.motions, *more.motions], shares, self.refused + more.refused)


def made_safe(stage: Stage, motions: Sequence[Motion], step: float | None = None) -> Safe:
    """Rehearse the motions in all cases, shrink what breaks a limit, give up what never keeps them.

    In steps of `step` [s], where these are not the stage's own. The cases come in turn, round after round, until each
    motion has passed all of them as it is: one that was made smaller goes on where it was stopped.
    """
    step = stage.step if step is None else step
    tests = [_Test(motion) for motion in motions]
    while any(t.goes_on(stage) for t in tests):
        for k, case in enumerate(stage.cases):
            here = weighed(stage, case)
            while now := [t for t in tests if t.goes_on(stage) and k not in t.passed]:
                some = [t.motion for t in now]
                runs = rehearse(stage.machine, some, case.effects, step, stage.rules.motions.settle, between=True)
                for test, verdict in zip(now, judge(here, runs, some), strict=True):
                    test.hears(verdict, k, case.name, stage.rules.motions.shrink)
    kept = [t for t in tests if t.has_passed(stage)]
    shares = np.array([t.reached for t in kept]).reshape(len(kept), 3, len(stage.machine.home))
    return Safe([t.motion for t in kept], shares, Counter(t.reason for t in tests if not t.has_passed(stage)))


def weighed(stage: Stage, case: Case) -> Stage:
    """The stage of a robot that weighs what a case says."""
    weighs = vary(stage.machine.plant, case.effects).model
    return replace(stage, around=stage.around.weighing(weighs))


def proven(stage: Stage, motions: Sequence[Motion]) -> Safe:
    """The motions made safe in fine steps; what long steps see already is seen in them, at a fraction of the cost."""
    fine, refused = stage.machine.steps[0], Counter[str]()
    if fine < stage.step:
        rough = made_safe(stage, motions)
        motions, refused = rough.motions, rough.refused
    safe = made_safe(stage, motions, fine)
    return Safe(safe.motions, safe.reached, safe.refused + refused)


class _Test:
    """One motion on its way through the cases."""

    def __init__(self, motion: Motion) -> None:
        self.motion, self.reason, self.shrinks = motion, "", 0
        self.passed: set[int] = set()
        """Cases that it passed as it is."""
        self.reached: np.ndarray | float = 0.0
        """(3, J) largest shares of the limits in these."""

    def hears(self, verdict: Verdict, case: int, name: str, shrink: float) -> None:
        """Pass a case, or grow smaller and begin anew."""
        if not verdict.reason:
            self.passed.add(case)
            self.reached = np.maximum(self.reached, verdict.reached)
            return
        self.motion, self.reason = self.motion.smaller(verdict.joints, shrink), f"{verdict.reason} ({name})"
        self.shrinks, self.passed, self.reached = self.shrinks + 1, set(), 0.0

    def has_passed(self, stage: Stage) -> bool:
        """Whether no case is left."""
        return len(self.passed) == len(stage.cases) and self.shrinks <= stage.rules.motions.shrinks

    def goes_on(self, stage: Stage) -> bool:
        """Whether it is neither safe nor given up."""
        return not self.has_passed(stage) and self.shrinks <= stage.rules.motions.shrinks
