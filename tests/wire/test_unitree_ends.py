"""Unitree's messages at both ends: what they carry comes back, and what they do not say is said as it is known."""

import dataclasses
import sys

import numpy as np
import pytest

from bumblebee.errors import BadInput
from bumblebee.robot.facts import joint_names
from bumblebee.wire.clock import SECOND
from bumblebee.wire.links.lcm_codec import Codec, decode_card
from bumblebee.wire.links.link import open_link
from bumblebee.wire.links.unitree_ends import ControllerEnd, RobotEnd
from bumblebee.wire.links.unitree_hg import HELD
from bumblebee.wire.links.unitree_link import URL, read_address
from bumblebee.wire.messages import CARD, ORDER, STATE, Mode, Order, State, layout_of

CODEC, SOME = Codec(23), np.linspace(0.1, 1.0, 23).astype(np.float32).astype(float)
WRITER, NOW = 77, 5 * SECOND


def order(mode: Mode = Mode.RUN, sequence: int = 9) -> bytes:
    return CODEC.encode_order(Order(5, layout_of(joint_names()), sequence, 7, 1, mode, SOME, 40 * SOME, SOME, -SOME))


def state_message(stamp_ms: int = 1234) -> bytes:
    state = State(
        11, layout_of(joint_names()), 3, stamp_ms * 1_000_000, SOME, -SOME, 2 * SOME, np.array([1.0, 0, 0, 0]),
        SOME[:3], np.zeros(3), np.zeros(3), np.zeros(2), np.full(23, np.nan), np.zeros(23, dtype=np.int64), Mode.OFF,
        0, -1, 0,
    )  # fmt: skip
    return CODEC.encode_state(state)


def low_state() -> np.ndarray:
    return RobotEnd().state(state_message())


def told(end: ControllerEnd, now: int = NOW, listened: bool = True, writer: int = WRITER) -> State:
    return CODEC.state(end.state(low_state(), writer, now, listened)[0])


def test_a_state_comes_back_and_what_is_not_in_it_is_unknown() -> None:
    state = told(ControllerEnd(40.0, 1.0))
    for name, expected in (("joint_pos", SOME), ("joint_vel", -SOME), ("joint_torque", 2 * SOME)):
        np.testing.assert_array_equal(getattr(state, name), expected)
    assert state.base_ang_vel.tolist() == SOME[:3].tolist() and state.stamp_ns == 1_234_000_000
    assert all(np.isnan(getattr(state, name)).all() for name in ("base_lin_vel", "base_pos", "foot_force"))
    assert (state.controller, state.heard, state.heard_ns) == (0, -1, -1)


def test_a_robot_of_the_vendors_is_real_and_our_own_is_simulated() -> None:
    record = low_state()
    for simulated in (True, False):
        assert decode_card(ControllerEnd(40.0, 1.0).state(record, WRITER, NOW, True)[1]).simulated is simulated
        record["reserve"] = 0


def test_an_order_comes_back_and_only_our_own_robot_is_told_that_it_carries_itself() -> None:
    end = ControllerEnd(40.0, 1.0)
    assert end.order(order()) is None  # where are the wrists?
    told(end)
    for mode in Mode:
        sent = end.order(order(mode))
        assert sent is not None and sent["reserve"].any() == (mode is Mode.RUN)
        read = CODEC.order(RobotEnd().order(sent, WRITER))
        assert read.mode is mode and read.controller > 0
    assert sent["motor_cmd"]["kp"][HELD].tolist() == [40.0] * 6
    np.testing.assert_array_equal(read.target, SOME)
    real, record = ControllerEnd(40.0, 1.0), low_state()
    record["reserve"] = 0
    real.state(record, WRITER, NOW, True)
    assert not real.order(order())["reserve"].any()  # type: ignore[index]


def test_wrists_are_held_where_they_hang_when_the_robot_is_carried() -> None:
    end, record = ControllerEnd(40.0, 1.0), low_state()
    told(end)
    end.order(order(Mode.OFF))
    for moved, mode, held in (
        (1.5, Mode.HOLD, 1.5),
        (1.7, Mode.RUN, 1.5),
        (0.2, Mode.DAMP, 1.5),
        (0.2, Mode.HOLD, 0.2),
    ):
        record = record.copy()
        record["motor_state"]["q"][HELD] = moved
        end.state(record, WRITER, NOW, True)
        sent = end.order(order(mode))
        assert sent is not None
        np.testing.assert_allclose(sent["motor_cmd"]["q"][HELD], held)


def test_who_is_listened_to_is_told_by_readers_and_by_orders_that_are_not_ours() -> None:
    end = ControllerEnd(40.0, 1.0)
    assert told(end).controller == 0
    end.order(order(sequence=4))
    assert told(end, listened=False).controller == 0
    assert (told(end).controller, told(end).heard, told(end).mode) == (5, 4, Mode.RUN)
    end.another(NOW)
    assert told(end, NOW + SECOND // 4).controller not in (0, 5)
    assert told(end, NOW + SECOND).controller == 5


def test_states_of_two_robots_have_two_numbers() -> None:
    end = ControllerEnd(40.0, 1.0)
    assert [told(end, writer=writer).robot for writer in (7, 8, 7)] == [1, 2, 1]


@pytest.mark.parametrize(("name", "came"), [("mode_machine", 4), ("mode_machine", 6), ("mode_pr", 1)])
def test_a_g1_with_other_joints_is_refused(name: str, came: int) -> None:
    record = low_state()
    record[name] = came
    with pytest.raises(BadInput, match=f"{name}: expected .*, came {came}"):
        ControllerEnd(40.0, 1.0).state(record, WRITER, NOW, True)


def test_gains_of_the_wrists_are_asked_for_and_the_printed_address_has_them(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "cyclonedds.core", None)
    monkeypatch.setitem(sys.modules, "cyclonedds", None)
    with pytest.raises(BadInput, match="wrists") as asked:
        open_link("unitree", [STATE], "dds://127.0.0.1")
    assert f"--at '{URL}'" in str(asked.value) and read_address(URL).wrists == (40.0, 1.0)
    for at, listen in ((URL, [STATE, CARD]), ("", [ORDER])):
        with pytest.raises(BadInput, match=r"pip install -e '\.\[unitree\]'"):
            open_link("unitree", listen, at)


@pytest.mark.parametrize("at", ["lo", "dds://", "dds://lo?kp=1", "dds://lo?kp=1&kd=no", "dds://lo?kp=1&kd=2&x=3"])
def test_another_address_is_one_line(at: str) -> None:
    with pytest.raises(BadInput, match="--at: expected an address as dds://"):
        read_address(at)


def test_no_two_addresses_are_mixed_up() -> None:
    local, cable = read_address("dds://127.0.0.1?domain=3"), read_address("dds://192.168.123.5?kp=1&kd=2")
    assert (local.domain, local.wrists, cable.domain, cable.wrists) == (3, None, 0, (1.0, 2.0))
    assert 'Peer Address="127.0.0.1"' in local.config and "Peer" not in cable.config
    assert dataclasses.replace(local, domain=4).config == local.config
