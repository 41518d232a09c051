"""A robot of three joints that goes where orders say, its policy, and the guard between them: no physics, no clock."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from bumblebee.wire.journal import Entry, record
from bumblebee.wire.messages import Mode, State
from bumblebee.wire.operator.keys import Keys
from bumblebee.wire.plan import Plan
from bumblebee.wire.policy_end.questions import Answer, Question
from bumblebee.wire.safety.guard import PERIOD, Guard, Tick
from bumblebee.wire.safety.intake import numbers_for
from bumblebee.wire.safety.limits import Drives
from bumblebee.wire.safety.phases import Phase, Ramps
from bumblebee.wire.safety.rules import Reference, Wish
from tests.wire.made import JOINTS, state

QUICK = Ramps(rise_speed=5.0, rise_least=0.1, soften=0.05, ready=0.05, blend=0.1, stand=0.1, damp=0.1)
HOLD = np.array([0.2, 0.5, -0.3])
CONTROLLER, FRAMES = 5, 40


def drives() -> Drives:
    one = np.ones(3)
    return Drives(JOINTS, -2 * one, 2 * one, 20 * one, 50 * one, 0.25 * one, 40 * one, 2 * one)


def plan(frames: int = FRAMES, **other: Any) -> Plan:
    values: dict[str, Any] = {"unattended": True, "ramps": QUICK}
    return Plan(CONTROLLER, 11, 4, frames, HOLD, numbers_for(("velocity", "place")), **values | other)


@dataclass
class Small:
    """One run, tick by tick; the hooks change what reaches the guard from the time `at` [s] on, None loses it."""

    plan: Plan = field(default_factory=plan)
    seen: Callable[[State, float], State | None] = lambda state, late: state
    says: Callable[[Answer, float], Answer | None] = lambda answer, late: answer
    keys: Callable[[Keys, float], Keys | None] = lambda keys, late: keys
    missed: Callable[[float], int] = lambda late: 0
    at: float = 1e9

    def __post_init__(self) -> None:
        self.guard = Guard(self.plan, drives(), 0)
        self.ticks: list[Tick] = []
        self._state = state(sequence=0, stamp_ns=1, controller=0, heard=-1, mode=Mode.OFF)

    def run(self, seconds: float) -> list[Tick]:
        """Run for a time; the ticks so far."""
        for _ in range(round(seconds * 1e9) // PERIOD):
            self._step()
        return self.ticks

    def until(self, phase: Phase) -> float:
        """Run until a phase begins; the time then [s]."""
        while self.guard.phase is not phase:
            assert len(self.ticks) < 2000, f"{phase.name} never came: {self.guard.phase.name} {self.guard.reason}"
            self._step()
        return self.ticks[-1].order.stamp_ns * 1e-9

    def _step(self) -> None:
        now = len(self.ticks) * PERIOD
        late, tick = now * 1e-9 - self.at, self.ticks[-1] if self.ticks else None
        whole = late < 0
        keys = Keys(now, goes=1 + (self.guard.phase >= Phase.READY))
        if (told := keys if whole else self.keys(keys, late)) is not None:
            self.guard.told(now, told)
        if tick is not None and tick.question is not None:
            answer = answer_to(tick.question)
            if (said := answer if whole else self.says(answer, late)) is not None:
                self.guard.answered(said)
        self._state = self._moved(tick, now)
        if (seen := self._state if whole else self.seen(self._state, late)) is not None:
            self.guard.heard(now, seen)
        self.ticks.append(self.guard.tick(now, 0 if whole else self.missed(late)))

    def _moved(self, tick: Tick | None, now: int) -> State:
        """The next state: joints half of the way to their targets."""
        last = self._state
        new = replace(last, sequence=last.sequence + 1, stamp_ns=last.stamp_ns + PERIOD, joint_vel=np.zeros(3))
        if tick is None:
            return new
        order = tick.order
        way = 0.5 * (order.target - last.joint_pos) * (order.mode in (Mode.HOLD, Mode.RUN)) * (order.kp > 0)
        heard = {"mode": order.mode, "controller": order.controller, "heard": order.sequence, "heard_ns": new.stamp_ns}
        return replace(new, joint_pos=last.joint_pos + way, **heard)


def answer_to(question: Question, **other: Any) -> Answer:
    """A policy that swings a little about the reference."""
    target = HOLD + 0.1 * np.sin(question.tick / 5)
    wish = Wish(**{"target": target, "kp": drives().kp, "kd": drives().kd, "torque": np.zeros(3)} | other)
    reference = Reference(HOLD, np.array([1.0, 0, 0, 0]), 0.8)
    return Answer(question.tick, question.asked_ns, question.state.sequence, wish, reference, np.full(3, 0.4))


def small_records(seconds: float = 0.5) -> bytes:
    """Records of a run's begin, 200 a second."""
    small = Small()
    return b"".join(record(Entry(tick, small.guard.intake.state, 1), 3) for tick in small.run(seconds))
