"""The console: what keys do, and the numbers that it shows."""

import json
import os
import select
import socket
import termios
import threading
from pathlib import Path

import numpy as np

from bumblebee.wire.job import Job
from bumblebee.wire.journal import Entry, Writer, record
from bumblebee.wire.links import packets
from bumblebee.wire.operator.console import _attend
from bumblebee.wire.operator.keys import END, GO, HELP, HOLD, OFF, Hand, Keys, decode_keys, encode_keys
from bumblebee.wire.operator.screen import Durations, Numbers
from bumblebee.wire.operator.terminal import Terminal
from bumblebee.wire.operator.watcher import STOP, Watcher
from bumblebee.wire.safety.guard_process import END as END_OF_RUN
from bumblebee.wire.safety.guard_process import RECORD
from bumblebee.wire.safety.phases import Phase
from tests.wire.small import Small, drives, plan, small_records

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


def test_numbers_are_those_of_all_records() -> None:
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


def test_percentiles_of_durations_are_those_of_all_and_at_most_one_percent_too_large() -> None:
    times, counted = np.append(np.random.default_rng(0).lognormal(0.0, 2.0, 5000), 0.0), Durations()
    for time in times:
        counted.add(time)
    for percent in (50, 99):
        exact = np.percentile(times, percent, method="inverted_cdf")
        assert 1.0 <= counted.percentile(percent) / exact <= 1.0101
    assert counted.worst == times.max() and np.isnan(Durations().percentile(50))


def test_the_lines_of_a_screen_fit_a_terminal() -> None:
    numbers = Numbers(3)
    numbers.add(small_records(0.3))
    lines = numbers.lines(numbers.table())
    assert "missed ticks 0" in lines[-1] and max(map(len, lines)) < 120


class Somebody:
    """A guard that says what it was told, record by record, until it is told to stop."""

    def __init__(self, end: socket.socket, watcher: socket.socket, before: bytes) -> None:
        self._end, self._watcher, self._before, self.keys = end, watcher, before, list[Keys]()
        self.returncode = 0
        packets.send(end, RECORD + small_records(0.3))

    def play(self) -> None:
        while not self.keys or not self.keys[-1].stops:
            assert select.select([self._end], [], [], 20.0)[0]
            self.keys += map(decode_keys, packets.received(self._end))
            if self.keys and self._before:
                packets.send(self._watcher, self._before)
                self._before = b""
        packets.send(self._end, END_OF_RUN + json.dumps({"reason": "stop_key"}).encode())
        self._end.close()

    def wait(self) -> None:
        """It has ended."""


def test_a_watcher_sees_the_run_and_its_one_word_is_a_stop_key_and_nothing_more(tmp_path: Path) -> None:
    (ours, end), (console, watching) = packets.pair(), packets.pair()
    guard = Somebody(end, watching, STOP)
    playing = threading.Thread(target=guard.play)
    playing.start()
    job, writer = Job("sim", "", 1.0, plan(), drives()), Writer(tmp_path / "a.journal", {"joints": list("abc")})
    try:
        ended = _attend(job, ours, writer, Terminal(os.open(os.devnull, os.O_RDONLY)), guard, Watcher(console))  # type: ignore[arg-type]
    finally:
        playing.join()
        writer.close()
    assert ended.reason == "stop_key" and guard.keys[-1].stops == 1
    assert all(keys.goes == keys.ends == 0 and keys.held_ns == guard.keys[0].held_ns for keys in guard.keys)
    facts = [json.loads(message) for message in packets.received(watching)]
    assert (
        facts[-1]["records"] == ended.numbers.count > 0 and facts[-1]["phase"] == Phase(ended.numbers.row["phase"]).name
    )
