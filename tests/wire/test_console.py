"""The console: what keys do, and the numbers that it shows."""

import os
import select
import termios

import numpy as np

from bumblebee.wire.journal import Entry, record
from bumblebee.wire.keys import END, GO, HELP, HOLD, OFF, Hand, decode_keys, encode_keys
from bumblebee.wire.screen import Numbers
from bumblebee.wire.terminal import Terminal
from tests.wire.small import Small, small_records

SECOND = 1_000_000_000


def pressed(*presses: tuple[float, str]) -> Hand:
    hand = Hand(0)
    for at, text in presses:
        hand.press(text, round(at * SECOND))
    return hand


def test_a_key_that_is_held_goes_on_once_and_a_second_press_goes_on_again() -> None:
    repeated = [(0.0, GO), *((0.5 + k / 30, GO * 2) for k in range(60))]
    assert pressed(*repeated).keys.goes == 1
    assert pressed(*repeated, (4.0, GO)).keys.goes == 2


def test_only_its_own_key_takes_the_torque_off() -> None:
    assert pressed(*((k / 30, "x") for k in range(90))).keys.stops == 1
    assert pressed((0.0, "x"), (0.1, OFF)).keys.stops == 2
    assert pressed((0.0, OFF), (0.1, "x")).keys.stops == 2
    hand = pressed((0.0, HOLD + GO + END))
    assert hand.keys.stops == 0
    hand.stop()
    assert hand.keys.stops == 1


def test_the_operators_own_keys_say_that_somebody_is_there_and_others_do_not() -> None:
    for key, there in ((HOLD, 5), (GO, 5), (END, 5), ("x", 0), ("", 0)):
        assert pressed((5.0, key)).keys.held_ns == there * SECOND
    assert pressed((5.0, END)).keys.ends == 1
    keys = pressed((1.0, GO + HOLD), (2.0, "x")).keys
    assert decode_keys(encode_keys(keys)) == keys and all(word in HELP for word in ("SPACE", "g:", "q:", "0:"))


def test_keys_come_at_once_without_enter_and_the_terminal_is_as_it_was_afterwards() -> None:
    ours, theirs = os.openpty()
    terminal, before = Terminal(theirs), termios.tcgetattr(theirs)
    assert terminal.keys and terminal.pressed() == ""
    with terminal.raw():
        os.write(ours, b" g")
        assert select.select([theirs], [], [], 5.0)[0] and terminal.pressed() == " g" and terminal.pressed() == ""
    assert termios.tcgetattr(theirs) == before
    os.close(ours)
    os.close(theirs)
    read, write = os.pipe()
    assert not Terminal(read).keys and Terminal(read).pressed() == ""
    os.close(read)
    os.close(write)


def test_numbers_are_those_of_all_records_and_fit_a_terminal() -> None:
    numbers = Numbers(3)
    assert numbers.lines(numbers.table()) == ["waiting for the guard"]
    numbers.add(small_records(0.3))
    small = Small()
    small.run(0.1)
    for k in range(1, 101):
        entry = Entry(small.ticks[-1], small.guard.intake.state, 1, int(k == 7), (k * 10**6, 0, 10**6, 10**6))
        numbers.add(record(entry, 3))
    assert numbers.missed == 1 and numbers.table()["wake"][2] == 100.0
    p50, p99, worst = numbers.table()["wake to send"]
    assert worst == 2.0 and p99 == 2.0 and p50 in (0.0, 2.0)
    lines = numbers.lines(numbers.table())
    assert "missed ticks 1" in lines[-1] and max(map(len, lines)) < 120 and np.isfinite(worst)
