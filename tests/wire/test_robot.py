"""The simulated robot on a wire: its own deadline, its own clock, one controller, a gantry, faults that are drawn."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from bumblebee.robot.facts import joint_names, joints, stand_pose
from bumblebee.robot.model import gains
from bumblebee.wire.clock import SECOND
from bumblebee.wire.links.lcm_codec import Codec, decode_card
from bumblebee.wire.links.line import Line, LineFaults
from bumblebee.wire.messages import CARD, STATE, Mode, Order, State, layout_of
from bumblebee.wire.robot_end.robot import RobotSettings, WireRobot

MS = SECOND // 1000
CODEC = Codec(23)


def robot(**settings: Any) -> WireRobot:
    return WireRobot([], RobotSettings(**{"state_hz": 250, "noise": 0.0} | settings), 0)


def order(sequence: int, mode: Mode = Mode.HOLD, **other: Any) -> Order:
    kp, kd = np.array([gains(joint) for joint in joints()]).T
    values: dict[str, Any] = {"target": stand_pose(), "kp": kp, "kd": kd, "torque": 0 * kp}
    return Order(5, layout_of(joint_names()), sequence, 0, 0, mode, **values | other)


def lived(made: WireRobot, begin: int, end: int, orders: dict[int, Order] | None = None) -> list[State]:
    """States from `begin` to `end` [ms]; orders by the time at which they come [ms]."""
    states = []
    for now in range(begin, end):
        given = [CODEC.encode_order(orders[now])] if orders and now in orders else []
        states += [CODEC.state(m) for channel, m in made.advance(now * MS, given) if channel == STATE]
    return states


def test_a_robot_damps_by_itself_20_ms_after_the_last_order_and_forgets_its_controller_later() -> None:
    made = robot()
    before = lived(made, 0, 20)
    assert {state.mode for state in before} == {Mode.OFF} and before[-1].controller == 0
    states = lived(made, 20, 600, {20: order(1), 25: order(2)})
    modes = [state.mode for state in states]
    assert modes == [Mode.HOLD] * 7 + [Mode.DAMP] * (len(modes) - 7)  # from 20 to 48 ms: it looks every 4 ms
    assert states[8].controller == 5 and states[-1].controller == 0


def test_states_count_up_and_are_stamped_by_the_robots_own_clock() -> None:
    states = lived(robot(clock_ppm=1000.0), 0, 100)
    assert [state.sequence for state in states] == list(range(25))
    assert np.diff([state.stamp_ns for state in states]).tolist() == [4_004_000] * 24


def test_a_state_says_which_order_is_in_force_and_when_it_came() -> None:
    states = lived(robot(), 0, 40, {12: order(7), 20: order(8)})
    first = next(state for state in states if state.heard == 7)
    assert first.stamp_ns - first.heard_ns == pytest.approx(4 * MS, abs=500)
    assert states[-1].heard == 8 and states[-1].stamp_ns - states[-1].heard_ns == pytest.approx(20 * MS, abs=2000)


def test_orders_that_do_not_fit_are_not_taken() -> None:
    made = robot()
    good = order(5)
    lived(made, 0, 10, {0: good})
    for k, (bad, why) in enumerate(
        [
            (replace(good, controller=6, sequence=9), "another controller"),
            (replace(good, layout=1, sequence=9), "another layout"),
            (replace(good, sequence=5), "an old order"),
            (replace(good, sequence=9, target=np.full(23, np.nan)), "no numbers"),
            (replace(good, sequence=9, kp=np.full(23, 1e4)), "gains"),
            (replace(good, sequence=9, kd=np.full(23, -1.0)), "gains"),
        ]
    ):
        before = made.hearing.refused[why]
        lived(made, 10 + k, 11 + k, {10 + k: bad})
        lived(made, 20 + 4 * k, 24 + 4 * k)
        assert made.hearing.refused[why] == before + 1, why
    made.advance(60 * MS, [b"nothing"])
    made.advance(70 * MS, [])
    assert made.hearing.refused["no message"] == 1 and made.hearing.order is not None
    assert made.hearing.order.sequence == 5


def test_the_gantry_holds_it_off_the_floor_lowers_it_to_stand_and_lets_go_when_it_carries_itself() -> None:
    made = robot()
    hanging = lived(made, 0, 300)[-1]
    assert hanging.base_pos[2] > 0.82 and hanging.foot_force.max() == 0
    held = lived(made, 300, 1200, {t: order(t) for t in range(300, 1200, 5)})[-1]
    assert held.foot_force.sum() > 150 and held.base_pos[2] == pytest.approx(0.78, abs=0.02)
    limp = np.zeros(23)
    falling = {t: order(t, Mode.RUN, kp=limp, kd=limp) for t in range(1200, 1600, 5)}
    fallen = lived(made, 1200, 1600, falling)[-1]
    assert fallen.base_pos[2] < 0.6
    caught = lived(made, 1600, 2300)[-1]
    assert caught.mode is Mode.OFF or caught.mode is Mode.DAMP
    assert made.robots.truth().base_pos[0, 2] > fallen.base_pos[2]


def test_its_card_says_who_it_is_once_a_second() -> None:
    made = robot()
    cards = [m for now in range(1100) for channel, m in made.advance(now * MS, []) if channel == CARD]
    card = decode_card(cards[0])
    assert len(cards) == 2 and card.joints == joint_names() and card.simulated and card.name == "g1_23dof"


def test_faults_of_a_line_are_drawn_from_its_seed() -> None:
    def arrived(faults: LineFaults, seed: int) -> list[tuple[int, bytes]]:
        line = Line(faults, np.random.default_rng(seed))
        for k in range(200):
            line.push(k * MS, "", bytes([k]))
        return [(now, message) for now in range(400) for _, message in line.due(now * MS)]

    faults = LineFaults(delay=0.002, jitter=0.001, dropped=0.1, late=0.1, late_by=0.05)
    once = arrived(faults, 3)
    assert once == arrived(faults, 3) != arrived(faults, 4)
    assert 160 < len(once) < 195
    delays = np.array([now - message[0] for now, message in once])
    assert ((delays >= 2) & (delays <= 3)).sum() + ((delays >= 52) & (delays <= 53)).sum() == len(once)
    assert 5 < (delays > 50).sum() < 40
    assert [message for _, message in arrived(LineFaults(), 0)] == [bytes([k]) for k in range(200)]


def test_a_machine_that_was_busy_costs_the_robot_time_and_no_state() -> None:
    made = robot()
    lived(made, 0, 20)
    states = [CODEC.state(m) for channel, m in made.advance(2000 * MS, []) if channel == STATE]
    assert len(states) <= 15 and made.slipped > 1.9 * SECOND
    assert np.diff([state.sequence for state in states]).tolist() == [1] * (len(states) - 1)
