"""Unitree's DDS on loopback: what goes out at one end comes in at the other, and a second controller is heard."""

import time
from collections.abc import Callable
from pathlib import Path

import pytest

from bumblebee.wire.links.lcm_codec import Codec, decode_card
from bumblebee.wire.links.link import Link, open_link
from bumblebee.wire.messages import CARD, ORDER, STATE, State
from tests.wire.test_links import address, dds_here
from tests.wire.test_unitree_ends import SOME, order, state_message

pytestmark = pytest.mark.skipif(not dds_here(), reason="no cyclonedds: docs/deploy.md builds it")
CODEC = Codec(23)


class Wire:
    """A robot that tells a state each 10 ms, and a controller that sends an order for each that comes."""

    def __init__(self, at: str) -> None:
        self.robot, self.controller = open_link("unitree", [ORDER], at), open_link("unitree", [STATE], at)
        self.others = list[Link]()
        self.stamp_ms = self.sequence = 0
        self.states, self.orders = list[State](), list[bytes]()

    def until(self, done: Callable[[], bool]) -> None:
        for _ in range(1000):
            if done():
                return
            time.sleep(0.01)  # ends go by the clock, and an exchange takes less than 1 ms
            self.stamp_ms += 10
            self.robot.send(STATE, state_message(self.stamp_ms))
            self.controller.wait(0.01)
            for channel, message in self.controller.received():
                assert channel == STATE
                self.states.append(CODEC.state(message))
                self.sequence += 1
                self.controller.send(ORDER, order(sequence=self.sequence))
            for other in self.others:
                other.received()
                other.send(ORDER, order(sequence=1))
            self.orders += [message for _, message in self.robot.received()]
        raise AssertionError((len(self.states), len(self.orders)))


def test_states_and_orders_cross_and_a_second_controller_is_heard(tmp_path: Path) -> None:
    at = address("unitree", tmp_path)
    wire = Wire(at)
    wire.until(lambda: bool(wire.orders) and wire.states[-1].controller == 5)
    assert CODEC.order(wire.orders[-1]).target.tolist() == SOME.tolist()
    assert wire.states[-1].joint_pos.tolist() == SOME.tolist() and wire.states[-1].heard > 0
    stamps = [state.stamp_ns for state in wire.states]
    assert stamps == sorted(set(stamps))
    wire.others.append(open_link("unitree", [STATE], at))
    wire.until(lambda: wire.states[-1].controller not in (0, 5))
    met, came = open_link("unitree", [STATE, CARD], at), list[tuple[str, bytes]]()
    wire.until(lambda: bool(came_of(met, came)))
    cards = [decode_card(message) for channel, message in came if channel == CARD]
    assert cards[0].simulated
    states = [CODEC.state(message) for channel, message in came if channel == STATE]
    assert states[0].controller != 0, "the controller that is there already is known before anything moves"
    for link in (wire.robot, wire.controller, met, *wire.others):
        link.close()


def came_of(link: Link, came: list[tuple[str, bytes]]) -> list[tuple[str, bytes]]:
    """All that came so far."""
    came += link.received()
    return came
