"""The guard: phases in their order, questions at 50 Hz, and each rule tripped once with the time until it damps."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from bumblebee.wire.clock import SECOND
from bumblebee.wire.messages import Mode
from bumblebee.wire.safety.guard import PERIOD, Guard
from bumblebee.wire.safety.limits import Limits
from bumblebee.wire.safety.phases import Phase, Ramps
from bumblebee.wire.safety.rules import RULES, Step, Wish, cut, torque_of
from tests.wire.made import state
from tests.wire.small import FRAMES, HOLD, Small, drives, plan

TICK = PERIOD * 1e-9
NAN = np.full(3, np.nan)


def changed(**fields: Any) -> Any:
    return {"seen": lambda state, late: replace(state, **fields)}


def wished(**fields: Any) -> Any:
    return {"says": lambda answer, late: replace(answer, wish=replace(answer.wish, **fields))}


LIMITS = Limits()
TRIPS: dict[str, tuple[dict[str, Any], str, float]] = {
    # What happens -> what does it, the rule that answers, and the time within which the drives must be damped [s].
    "a joint reads beyond its range": (changed(joint_pos=np.array([2.3, 0, 0])), "joint_range", 0),
    "a joint is too fast": (changed(joint_vel=np.array([0, 17.0, 0])), "speed", 0),
    "a joint is stuck at its torque limit": (changed(joint_pos=HOLD) | wished(target=HOLD + 1.5), "stall",
                                             LIMITS.stall + 0.025),
    "a drive takes too much power": (changed(joint_vel=np.array([0, 15.9, 0]), joint_pos=np.array([0, 1.9, 0])),
                                     "power", 0),
    "the robot tilts": (changed(base_quat=np.array([0.9, 0.436, 0, 0])), "tilt", 0),
    "the robot sinks": (changed(base_pos=np.array([0, 0, 0.45])), "tilt", 0),
    "no foot carries": (changed(foot_force=np.zeros(2)), "contact", LIMITS.air),
    "a motor is hot": (changed(temperature=np.array([20.0, 99.0, np.nan])), "temperature", 0),
    "a motor reports an error": (changed(error=np.array([0, 0, 4])), "motor_error", 0),
    "the robot falls silent": ({"seen": lambda state, late: None}, "silent", LIMITS.state_damp),
    "states repeat": (changed(sequence=7), "silent", LIMITS.state_damp),
    "states go backward": ({"seen": lambda state, late: replace(state, sequence=-state.sequence)}, "silent",
                           LIMITS.state_damp),
    "stamps stand still": (changed(stamp_ns=1), "silent", LIMITS.state_damp),
    "states are no numbers": (changed(joint_vel=NAN), "silent", LIMITS.state_damp),
    "the IMU is broken": (changed(base_quat=np.zeros(4)), "silent", LIMITS.state_damp),
    "another robot speaks": (changed(robot=12), "silent", LIMITS.state_damp),
    "the policy hangs": ({"says": lambda answer, late: None}, "policy_late", 0.02 + LIMITS.policy_damp),
    "the policy wants no number": (wished(target=NAN), "policy_number", 0.025),
    "the policy wants far too much": (wished(target=HOLD + 3.0), "policy_far", 0.025),
    "the robot takes no orders": (changed(heard=0), "deaf", LIMITS.deaf),
    "states come in order and late": ({"seen": lambda state, late: replace(state, heard=state.heard - 40)}, "deaf", 0),
    "the robot listens to another": (changed(controller=6), "other_controller", 0),
    "the robot damps by itself": (changed(mode=Mode.DAMP), "robot_damps", 0),
    "the dead-man's key is let go": ({"keys": lambda keys, late: replace(keys, held_ns=keys.held_ns - int(1e9 * late))},
                                     "dead_man", LIMITS.key),
    "the console dies": ({"keys": lambda keys, late: None}, "console", LIMITS.console),
    "the stop key is pressed": ({"keys": lambda keys, late: replace(keys, stops=1)}, "stop_key", 0),
}  # fmt: skip


def tripped_run(what: str) -> Small:
    """A run in which it happens a little after the policy has taken over."""
    (hooks, _, _), attended = TRIPS[what], what == "the dead-man's key is let go"
    small = Small(plan(unattended=not attended, frames=200), **hooks)
    small.at = small.until(Phase.RUN) + 0.11
    return small


@pytest.mark.parametrize("what", TRIPS)
def test_a_rule_damps_within_its_time(what: str) -> None:
    _, rule, within = TRIPS[what]
    small = tripped_run(what)
    damped = small.until(Phase.DAMP) - small.at
    assert small.guard.reason == rule and small.ticks[-1].order.mode is Mode.DAMP
    assert not small.ticks[-1].order.kp.any() and (small.ticks[-1].order.kd == drives().kd).all()
    assert damped <= within + 1.01 * TICK
    small.run(0.3)
    assert small.guard.phase is Phase.OFF and small.ticks[-1].order.mode is Mode.OFF


def test_every_rule_is_tripped_here() -> None:
    warns = {"soft_zone", "torque", "own_ticks"}
    assert {rule for _, rule, _ in TRIPS.values()} | warns == set(RULES)


def test_a_run_goes_through_its_phases_in_order_and_asks_the_policy_fifty_times_a_second() -> None:
    small = Small()
    small.until(Phase.OFF)
    order = [tick.phase for k, tick in enumerate(small.ticks) if not k or tick.phase is not small.ticks[k - 1].phase]
    assert order == list(Phase) and small.guard.reason == ""
    running = [tick for tick in small.ticks if tick.phase is Phase.RUN]
    asked = [tick.question.tick for tick in running if tick.question is not None]
    assert asked == list(range(len(asked))) and len(asked) >= FRAMES
    assert [bool(tick.question) for tick in running[:8]] == [True, False, False, False] * 2
    assert [tick.order.sequence for tick in small.ticks] == list(range(len(small.ticks)))
    assert {tick.order.mode for tick in small.ticks if tick.phase in (Phase.RISE, Phase.BLEND)} == {Mode.HOLD}


def test_standing_up_is_slow_and_nothing_jumps_when_the_policy_takes_over() -> None:
    small = Small(plan(ramps=Ramps(rise_speed=1.0, rise_least=0.3, soften=0.2, ready=0.1, blend=0.5, damp=0.1)))
    small.until(Phase.DAMP)
    told = [tick.order for tick in small.ticks if Phase.RISE <= tick.phase <= Phase.RUN]
    steps = np.abs(np.diff([order.target for order in told], axis=0)).max(axis=1)
    rising = [tick.phase is Phase.RISE for tick in small.ticks if Phase.RISE <= tick.phase <= Phase.RUN][1:]
    assert steps[rising].max() <= 1.01 * TICK * 1.0
    assert steps.max() < 0.03  # a control period of the policy itself moves by .02
    assert not told[0].kp.any() and (np.diff([order.kp[0] for order in told]) >= 0).all()


def test_nothing_moves_before_go_is_said_twice() -> None:
    goes = 0
    small = Small(plan(unattended=False), keys=lambda keys, late: replace(keys, goes=goes), at=0.0)
    assert {tick.order.mode for tick in small.run(0.5)} == {Mode.OFF}
    goes = 1
    small.run(0.8)
    assert small.guard.phase is Phase.READY
    goes = 2
    small.until(Phase.RUN)


def test_said_twice_before_the_robot_is_ready_it_is_once() -> None:
    small = Small(plan(unattended=False), keys=lambda keys, late: replace(keys, goes=2), at=0.0)
    small.until(Phase.READY)
    small.run(2.0)
    assert small.guard.phase is Phase.READY


def test_after_a_guard_that_stood_still_a_robot_that_hangs_rises_anew() -> None:
    """It damped meanwhile and hangs elsewhere: its joints are taken up where they are."""
    stood = iter([400])
    small = Small(seen=lambda state, late: replace(state, joint_pos=HOLD - 0.7), missed=lambda late: next(stood, 0))
    small.at = small.until(Phase.RISE) + 0.05
    small.run(0.08)
    first = next(k for k, tick in enumerate(small.ticks) if "own_ticks" in tick.rules)
    targets = np.array([tick.order.target for tick in small.ticks[first : first + 3]])
    assert small.guard.phase is Phase.RISE
    np.testing.assert_allclose(targets, np.tile(HOLD - 0.7, (3, 1)), atol=0.01)


def test_a_short_silence_holds_and_then_the_policy_goes_on() -> None:
    small = Small(seen=lambda state, late: None if late < 0.03 else state)
    small.at = small.until(Phase.RUN) + 0.11
    small.run(0.25)
    steps = [tick.step for tick in small.ticks[-50:]]
    assert Step.HOLD in steps and Step.DAMP not in steps and steps[-1] is Step.GO
    held = [tick.order.target for tick in small.ticks if tick.step is Step.HOLD]
    assert np.ptp(held, axis=0).max() == 0


def test_missed_ticks_warn_and_more_than_two_in_a_row_hold_and_the_clip_goes_on_in_time() -> None:
    late = iter([2, 0, 3])
    small = Small(missed=lambda _: next(late, 0))
    small.at = small.until(Phase.RUN) + 0.11
    before = len(small.ticks)
    small.run(0.3)
    steps = [tick.step for tick in small.ticks[before:]]
    assert steps.count(Step.WARN) == 1 and steps.count(Step.HOLD) == 1
    asked = [tick.question.tick for tick in small.ticks[before:] if tick.question is not None]
    assert asked[-1] == (len(small.ticks) - before + 2 + 3) // 4


def test_the_push_outward_fades_in_the_soft_zone_and_torque_keeps_within_its_limit() -> None:
    wish = Wish(np.array([3.5, -3.0, 0.4]), np.full(3, 40.0), np.full(3, 2.0), np.zeros(3))
    for reading, share in ((1.8, 1.0), (1.88, 1.0), (1.94, 0.5), (2.0, 0.0), (2.05, 0.0)):
        seen = state(joint_pos=np.array([reading, -reading, reading]), joint_vel=np.zeros(3))
        sent, over = cut(seen, wish, drives(), LIMITS)
        outward = np.minimum(np.array([3.5, 3.0]) - reading, 50.0 / 40.0 if share == 1.0 else 9.0)
        np.testing.assert_allclose(sent.target[:2] * [1, -1], reading + np.maximum(outward, 0) * share, atol=1e-9)
        assert sent.target[2] == pytest.approx(max(0.4, reading - 50.0 / 40.0))  # back into the range: as it was
        assert over[0] == (share == 1.0)
        assert (np.abs(torque_of(seen, sent)) <= drives().effort * (1 + 1e-9)).all()


def test_a_torque_beside_the_target_fades_in_the_soft_zone_too() -> None:
    for reading, share in ((1.88, 1.0), (1.94, 0.5), (2.0, 0.0)):
        at = np.array([reading, -reading, reading])
        wish = Wish(at, np.full(3, 40.0), np.full(3, 2.0), np.array([20.0, -20.0, -20.0]))
        sent, _ = cut(state(joint_pos=at, joint_vel=np.zeros(3)), wish, drives(), LIMITS)
        np.testing.assert_allclose(sent.torque, [20.0 * share, -20.0 * share, -20.0], atol=1e-9)  # the last: back in


def test_pressing_stop_again_takes_the_torque_off() -> None:
    small = Small(keys=lambda keys, late: replace(keys, stops=1 if late < 0.03 else 2))
    small.at = small.until(Phase.RUN) + 0.1
    small.until(Phase.DAMP)
    assert small.until(Phase.OFF) - small.at <= 0.03 + 1.01 * TICK


def test_a_robot_that_never_speaks_is_given_up() -> None:
    small = Small(seen=lambda state, late: None, at=0.0)
    small.run(1.0)
    assert small.guard.finished and small.guard.reason == "silent"
    assert {tick.order.mode for tick in small.ticks} == {Mode.OFF}


@pytest.mark.parametrize("up", [0.0, 86_400.0], ids=["booted", "up for a day"])
def test_a_robot_whose_first_state_has_heard_nothing_yet_is_deaf_only_once_its_limit_is_over(up: float) -> None:
    begun, unheard = round(up * SECOND), state(heard=-1, controller=0, mode=Mode.OFF)
    guard = Guard(plan(), drives(), begun)
    for tick in range(1, 200):
        now = begun + tick * PERIOD
        if tick >= 3:  # orders went out before this robot was there to hear them
            guard.heard(now, replace(unheard, sequence=tick, stamp_ns=tick * PERIOD))
        guard.tick(now)
        assert (guard.reason == "deaf") == ((tick - 3) * TICK > LIMITS.deaf), tick


def test_an_answer_to_an_older_question_counts_for_nothing() -> None:
    small = Small(says=lambda answer, late: replace(answer, asked_ns=answer.asked_ns - 1))
    small.at = small.until(Phase.RUN)
    small.until(Phase.DAMP)
    assert small.guard.reason == "policy_late"


def test_with_a_dead_mans_key_the_run_ends_when_the_operator_says_so() -> None:
    ends = 0
    keys = lambda keys, late: replace(keys, ends=ends)  # noqa: E731
    small = Small(plan(unattended=False), keys=keys, at=0.0)
    small.until(Phase.RUN)
    small.run(2.0)
    assert small.guard.phase is Phase.RUN
    ends = 1
    small.until(Phase.DAMP)
    assert small.guard.reason == ""


def test_judging_a_tick_once_more_changes_nothing() -> None:
    warm, cold = (Small(plan(frames=10), **changed(joint_pos=HOLD + 0.3)) for _ in range(2))
    warm.at = cold.at = 0.5
    while not cold.guard.finished:
        for small in (warm, cold):
            small.run(TICK)
        warm.guard.warm()
    assert [tick.phase for tick in warm.ticks] == [tick.phase for tick in cold.ticks]
    assert all(
        np.array_equal(one.order.target, other.order.target) and one.rules == other.rules
        for one, other in zip(warm.ticks, cold.ticks, strict=True)
    )
