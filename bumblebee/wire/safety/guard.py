"""The guard: 200 times a second it lets the policy's wish through to the drives, or holds, damps, switches off.

It is a function of the times, states, answers and keys that it is given; `guard_process` gives it the real ones.
"""

from dataclasses import dataclass, replace

import numpy as np

from bumblebee.wire.clock import SECOND
from bumblebee.wire.messages import Mode, Order, State, layout_of
from bumblebee.wire.operator.keys import Keys
from bumblebee.wire.plan import ORDER_HZ, Plan
from bumblebee.wire.policy_end.questions import Answer, Question
from bumblebee.wire.safety.intake import Intake
from bumblebee.wire.safety.limits import Drives
from bumblebee.wire.safety.phases import MODES, Phase, rise_time, smooth
from bumblebee.wire.safety.rules import Moment, Step, Wish, cut, tripped
from bumblebee.wire.safety.watch import Watch

PERIOD = round(SECOND / ORDER_HZ)
_AFTER = 0.2  # s for which orders to be off go out before the run ends


@dataclass(frozen=True)
class Tick:
    """Decisions of one tick of the guard."""

    order: Order
    question: Question | None
    """To the policy; None between its control ticks."""
    phase: Phase
    step: Step
    rules: dict[str, Step]
    """Those that asked for anything."""
    wish: Wish
    """Before anything was cut."""
    answer: Answer | None
    """The policy's answer in force."""


class Guard:
    """One run, from hanging to hanging.

    Args:
        plan: of the run.
        drives: of the robot.
        now: when it begins [ns].
    """

    def __init__(self, plan: Plan, drives: Drives, now: int) -> None:
        self._plan, self._drives, self._layout = plan, drives, layout_of(drives.joints)
        self.intake = Intake(plan.robot, self._layout, plan.numbers, now)
        self._watch = Watch(drives, plan.limits, 1.0 / ORDER_HZ)
        self.phase, self.reason = Phase.WAIT, ""
        """Phase now, and the rule that ended the run; "" where it ended in good order."""
        self._now, self._since, self._keys, self._keys_came = now, now, Keys(now), now
        self._sequence, self._count, self._goes = 0, 0, 0
        self._answer: Answer | None = None
        self._asked, self._due = -1, 0  # when the newest question was asked [ns], -1 for none that is open; until when
        self._begin, self._rise = np.zeros(len(drives.joints)), 0.0
        self._kept: Wish | None = None
        self._judged: tuple[Moment, Wish] | None = None

    @property
    def finished(self) -> bool:
        """Whether nothing is left to be sent."""
        return self.phase is Phase.OFF and self._now - self._since > _AFTER * SECOND

    def heard(self, now: int, state: State) -> None:
        """Take a state that came at `now` [ns]."""
        self.intake.take(now, state)

    def answered(self, answer: Answer) -> None:
        """Take the policy's answer to the newest question; older ones are late and worth nothing."""
        if answer.asked_ns == self._asked:
            self._answer, self._asked = answer, -1

    def told(self, now: int, keys: Keys) -> None:
        """Take what the console said."""
        self._keys, self._keys_came = keys, now

    def warm(self) -> None:
        """Judge the last tick once more and forget it, so that the next finds what it needs in the core's caches."""
        if self._judged is not None:
            moment, sent = self._judged
            tripped(moment, self._drives, self._plan.limits)
            cut(moment.state, sent, self._drives, self._plan.limits)

    def tick(self, now: int, missed: int = 0) -> Tick:
        """Decide on the order of this tick.

        Args:
            now: time [ns].
            missed: ticks in a row that should have been before this one and were not.
        """
        self._now, state = now, self.intake.state
        if missed > self._plan.limits.missed and self.phase in (Phase.RISE, Phase.READY) and state is not None:
            self._begin_to_rise(now, state)  # the robot has damped meanwhile, and hangs elsewhere
        self._move_on(now, state)
        question = self._ask(now, state, missed)
        wish = self._wish(now, state)
        if state is None:
            if self.intake.age(now) > self._plan.limits.console:
                self._end("silent", Phase.OFF, now)
            return self._tick(now, wish, wish, question, Step.GO, {})
        moment = self._moment(now, state, wish, missed)
        rules = tripped(moment, self._drives, self._plan.limits) if self.phase < Phase.DAMP else {}
        step = max(rules.values(), default=Step.GO)
        if self.phase is Phase.DAMP and self._keys.stops >= 2:
            step, rules = Step.OFF, {"stop_key": Step.OFF}
        if step >= Step.DAMP:
            worst = next(name for name, asked in rules.items() if asked is step)
            self._end(worst, Phase.OFF if step is Step.OFF or self.phase is Phase.WAIT else Phase.DAMP, now)
        sent, over = self._sent(state, wish, step)
        self._judged = moment, sent
        self._watch.look(state, over, self.phase is Phase.RUN)
        return self._tick(now, sent, wish, question, step, rules)

    def _tick(
        self, now: int, sent: Wish, wish: Wish, question: Question | None, step: Step, rules: dict[str, Step]
    ) -> Tick:
        state = self.intake.state
        answers, sequence = -1 if state is None else state.sequence, self._sequence
        self._sequence += 1
        mode = MODES[self.phase] if state is not None else Mode.OFF
        values = (sent.target, sent.kp, sent.kd, sent.torque)
        order = Order(self._plan.controller, self._layout, sequence, answers, now, mode, *values)
        return Tick(order, question, self.phase, step, rules, wish, self._answer)

    def _move_on(self, now: int, state: State | None) -> None:
        """Enter the next phase where this one is done."""
        plan, ramps, gone = self._plan, self._plan.ramps, (now - self._since) / SECOND
        go = lambda count: plan.unattended or self._keys.goes >= count  # noqa: E731
        if self.phase is Phase.WAIT and state is not None and state.controller == plan.controller and go(1):
            self._begin_to_rise(now, state)
        elif self.phase is Phase.RISE and gone >= self._rise:
            self._goes = self._keys.goes
            self._enter(Phase.READY, now)
        elif self.phase is Phase.READY and gone >= ramps.ready and go(self._goes + 1):
            self._enter(Phase.BLEND, now)
        elif self.phase is Phase.BLEND and gone >= ramps.blend and self._count % plan.every == 0:
            self._enter(Phase.RUN, now)
        elif self.phase is Phase.RUN and self._clip_tick() >= plan.frames:
            standing = (self._clip_tick() - plan.frames) * plan.every / ORDER_HZ
            if self._keys.ends or (plan.unattended and standing >= ramps.stand):
                self._enter(Phase.DAMP, now)
        elif self.phase is Phase.DAMP and gone >= ramps.damp:
            self._enter(Phase.OFF, now)

    def _begin_to_rise(self, now: int, state: State) -> None:
        """Ramp from where the joints are."""
        self._begin, self._rise = state.joint_pos.copy(), rise_time(state.joint_pos, self._plan.hold, self._plan.ramps)
        self.phase, self._since, self._kept = Phase.RISE, now, None

    def _end(self, reason: str, phase: Phase, now: int) -> None:
        self.reason = self.reason or reason
        self._enter(phase, now)

    def _enter(self, phase: Phase, now: int) -> None:
        if phase is not self.phase:
            self.phase, self._since = phase, now
            if phase in (Phase.BLEND, Phase.RUN):
                self._count = 0
            if phase >= Phase.DAMP:
                self._asked = -1

    def _clip_tick(self) -> int:
        """Control tick of the clip; the blend stays on its first."""
        return self._count // self._plan.every if self.phase is Phase.RUN else 0

    def _ask(self, now: int, state: State | None, missed: int) -> Question | None:
        """Question of this tick, if it is one of the policy's."""
        if self.phase not in (Phase.BLEND, Phase.RUN) or state is None:
            return None
        before = self._count - 1
        self._count += missed if self._count else 0
        due, tick = self._count // self._plan.every > before // self._plan.every, self._clip_tick()
        self._count += 1
        if not due:
            return None
        if self._asked < 0:  # else the oldest question without an answer says how late it is
            self._due = now + PERIOD
        self._asked = now
        return Question(tick, now, state)

    def _wish(self, now: int, state: State | None) -> Wish:
        """Order that this phase wants, before any rule."""
        gone, ramps, drives = (now - self._since) / SECOND, self._plan.ramps, self._drives
        zero = np.zeros_like(drives.kp)
        if self.phase is Phase.RISE:
            share, firm = smooth(gone / self._rise), min(gone / ramps.soften, 1.0)
            target = self._begin + share * (self._plan.hold - self._begin)
            return Wish(target, firm * drives.kp, drives.kd, zero)
        hold = Wish(self._plan.hold, drives.kp, drives.kd, zero)
        if self.phase is Phase.READY or (self.phase is Phase.BLEND and self._answer is None):
            return hold
        if self.phase is Phase.BLEND and self._answer is not None:
            share, wish = smooth(gone / ramps.blend), self._answer.wish
            parts = ("target", "kp", "kd", "torque")
            return Wish(*(getattr(hold, p) + share * (getattr(wish, p) - getattr(hold, p)) for p in parts))
        if self.phase is Phase.RUN and self._answer is not None:
            return self._answer.wish
        return self._still(state)

    def _sent(self, state: State, wish: Wish, step: Step) -> tuple[Wish, np.ndarray]:
        """Order that goes out, and which drives (J,) bool are cut at their torque."""
        none = np.zeros(len(wish.target), dtype=bool)
        if self.phase in (Phase.WAIT, Phase.OFF):
            return replace(self._still(state), kd=np.zeros_like(wish.kd)), none
        if self.phase is Phase.DAMP:
            return self._still(state), none
        if step is Step.HOLD and self._kept is not None:
            wish = self._kept
        self._kept = wish
        return cut(state, wish, self._drives, self._plan.limits)

    def _still(self, state: State | None) -> Wish:
        """Damping where the joints are."""
        zero = np.zeros_like(self._drives.kp)
        return Wish(zero if state is None else state.joint_pos, zero, self._drives.kd, zero)

    def _moment(self, now: int, state: State, wish: Wish, missed: int) -> Moment:
        attended, moving = not self._plan.unattended, self.phase is not Phase.WAIT
        late = max(0.0, (now - self._due) / SECOND) if self._asked >= 0 else 0.0
        return Moment(
            state=state,
            wish=wish,
            reference=self._answer.reference if self._answer is not None else None,
            carries=self.phase is Phase.RUN,
            state_age=self.intake.age(now),
            policy_late=late,
            deaf=self._watch.deaf(state, now, self._sequence),
            key_age=(now - self._keys.held_ns) / SECOND if attended and moving else 0.0,
            console_age=(now - self._keys_came) / SECOND,
            stops=self._keys.stops,
            missed=missed,
            air=self._watch.air,
            stalled=self._watch.stalled,
            controller=self._plan.controller,
        )
