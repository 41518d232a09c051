"""A whole run in one process and without a clock: robot, guard and policy in the time of their messages.

What is rehearsed is the code that runs on the wire, byte for byte, without sockets, sleeps and load.
"""

import heapq
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from bumblebee.wire.clock import SECOND
from bumblebee.wire.journal import Entry
from bumblebee.wire.links.lcm_codec import Codec
from bumblebee.wire.messages import STATE
from bumblebee.wire.operator.keys import Keys
from bumblebee.wire.plan import Plan
from bumblebee.wire.policy_end.brain import Brain
from bumblebee.wire.policy_end.questions import Answer
from bumblebee.wire.robot_end.robot import WireRobot
from bumblebee.wire.safety.guard import PERIOD, Guard, Tick
from bumblebee.wire.safety.limits import Drives

_STEP = SECOND // 1000


@dataclass
class Rehearsal:
    """A run that goes on while `entries` is walked through.

    `meddle` is called before each tick of the guard with the time since the start [ns], and may change anything.
    """

    robot: WireRobot
    brain: Brain
    plan: Plan
    drives: Drives
    think: float = 0.002
    """Time that the policy takes for an answer [s]."""
    keys: Callable[[int], Keys | None] = Keys
    """Keys at a time [ns]; None where the console says nothing."""
    meddle: Callable[[int], None] = lambda now: None
    longest: float = 120.0
    """When to give up [s]."""

    def __post_init__(self) -> None:
        self.guard = Guard(self.plan, self.drives, 0)
        self.hangs = False
        """Whether the policy answers no more."""
        self.deaf = False
        """Whether no state reaches the guard."""

    def entries(self) -> Iterator[Entry]:
        """Run, and give what the guard's journal gets, tick by tick."""
        codec, orders, waiting = Codec(len(self.drives.joints)), list[bytes](), list[tuple[int, int, Answer]]()
        for now in range(0, round(self.longest * SECOND), _STEP):
            for channel, message in self.robot.advance(now, orders):
                if channel == STATE and not self.deaf:
                    self.guard.heard(now, codec.state(message))
            orders = []
            if now % PERIOD:
                continue
            self.meddle(now)
            if (keys := self.keys(now)) is not None:
                self.guard.told(now, keys)
            while waiting and waiting[0][0] <= now:
                self.guard.answered(heapq.heappop(waiting)[2])
            tick = self.guard.tick(now)
            self._ask(now, tick, waiting)
            orders = [codec.encode_order(tick.order)]
            yield Entry(tick, self.guard.intake.state, self.guard.intake.came)
            if self.guard.finished:
                return

    def _ask(self, now: int, tick: Tick, waiting: list[tuple[int, int, Answer]]) -> None:
        if tick.question is not None and not self.hangs:
            answer = self.brain.answer(tick.question)
            heapq.heappush(waiting, (now + round(self.think * SECOND), now, answer))


def whole(rehearsal: Rehearsal) -> Sequence[Entry]:
    """All entries of a run, to its end."""
    return list(rehearsal.entries())
