"""Unitree's messages: sizes, checksum and slots as the vendor has them, and what is not ours is held."""

import struct

import numpy as np
import pytest

from bumblebee.errors import BadInput
from bumblebee.robot.facts import joint_names
from bumblebee.wire.links import unitree_hg
from bumblebee.wire.links.unitree_hg import HELD, LOW_CMD, LOW_STATE, MOTORS, OURS, as_cdr, checksum, command, from_cdr
from bumblebee.wire.messages import Mode, Order, layout_of

WRISTS = np.linspace(-0.3, 0.3, 6)
FORMAT = "<2B2x" + "B3x5fI" * 35 + "5I"


def order(mode: Mode = Mode.RUN) -> Order:
    some = np.linspace(0.1, 1.0, 23)
    return Order(5, layout_of(joint_names()), 9, 7, 1, mode, some, 100 * some, 2 * some, -some)


def bit_by_bit(message: bytes) -> int:
    """Checksum by shifts of a register, one bit after the other."""
    register = 0xFFFFFFFF
    for (word,) in struct.iter_unpack("<I", message[:-4]):
        for bit in range(31, -1, -1):
            high = register >> 31 ^ word >> bit & 1
            register = (register << 1 & 0xFFFFFFFF) ^ 0x04C11DB7 * high
    return register


def test_messages_are_as_long_as_the_vendors_and_lie_where_its_format_puts_them() -> None:
    assert (
        (LOW_CMD.itemsize, LOW_STATE.itemsize)
        == (1004, 2092)
        == (
            struct.calcsize(FORMAT),
            struct.calcsize("<2I2B2xI" + "13fh2x" + "B3x4f2hf7I" * 35 + "40B5I"),
        )
    )
    mode_pr, machine, *read = struct.unpack(FORMAT, command(order(), 5, WRISTS, 40.0, 1.0).tobytes())
    assert (mode_pr, machine) == (0, 5)
    knee = read[7 * 3 : 7 * 4]
    at = joint_names().index("left_knee_joint")
    np.testing.assert_allclose(knee[1:6], [order().target[at], 0, order().torque[at], order().kp[at], order().kd[at]])


def test_the_checksum_is_that_of_shifts_over_all_words_but_the_last() -> None:
    sent = command(order(), 5, WRISTS, 40.0, 1.0)
    assert int(sent["crc"]) == bit_by_bit(sent.tobytes())
    changed = sent.copy()
    changed["reserve"][3] = 1
    assert checksum(changed) != checksum(sent)


def test_23_of_29_motors_are_ours_and_the_wrists_are_held_where_they_were() -> None:
    assert len(MOTORS) == 29 and tuple(MOTORS[slot] for slot in OURS) == joint_names()
    assert all("wrist" in MOTORS[slot] for slot in HELD) and len(HELD) == 6
    motors = command(order(), 5, WRISTS, 40.0, 1.0)["motor_cmd"]
    np.testing.assert_allclose(motors["q"][HELD], WRISTS, rtol=1e-6)
    assert (motors["kp"][HELD] > 0).all() and (motors["kd"][HELD] > 0).all() and (motors["tau"][HELD] == 0).all()
    assert motors["mode"].tolist() == [1] * 29 + [0] * 6


def test_damping_has_kd_alone_and_off_no_motor() -> None:
    damps, off = (command(order(mode), 5, WRISTS, 40.0, 1.0)["motor_cmd"] for mode in (Mode.DAMP, Mode.OFF))
    assert not damps["kp"].any() and not damps["tau"].any() and (damps["kd"][:29] > 0).all()
    assert not any(off[name].any() for name in ("mode", "kp", "kd", "tau"))


def test_a_state_that_is_torn_or_of_another_length_is_refused() -> None:
    state = np.zeros((), LOW_STATE)
    state["imu_state"]["quaternion"] = [1, 0, 0, 0]
    state["motor_state"]["q"][OURS] = np.arange(23)
    state["crc"] = checksum(state)
    read = from_cdr(as_cdr(state), LOW_STATE)
    assert read["imu_state"]["quaternion"].tolist() == [1, 0, 0, 0]
    assert read["motor_state"]["q"][OURS].tolist() == list(range(23))
    for message, expected in ((as_cdr(state)[:-1], "2088 bytes"), (b"\1" + as_cdr(state)[1:], "crc")):
        with pytest.raises(BadInput, match=expected):
            from_cdr(message, LOW_STATE)
    sent = command(order(), 5, WRISTS, 40.0, 1.0)
    assert from_cdr(as_cdr(sent), LOW_CMD) == sent
    assert len(as_cdr(sent)) == struct.calcsize("<3Bx5fI" + "B3x5fI" * 34 + "5I")


def test_the_link_serves_the_robot_that_it_was_tried_with(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(unitree_hg, "ROBOT", "h1_19dof")
    with pytest.raises(BadInput, match="wire unitree: expected g1_23dof, came h1_19dof"):
        unitree_hg.require_served()
