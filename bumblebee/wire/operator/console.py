"""The console of a run: starts guard and policy, passes keys on, writes the journal, shows numbers.

It is never between policy and robot: when it dies or hangs, the guard damps.
"""

import json
import os
import select
import socket
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bumblebee.errors import BadInput
from bumblebee.motion.clip import Clip
from bumblebee.motion.store import write_library
from bumblebee.wire.clock import SECOND, Clock
from bumblebee.wire.job import Job, encode_job
from bumblebee.wire.journal import Writer
from bumblebee.wire.links import packets
from bumblebee.wire.operator.keys import HELP, Hand, encode_keys
from bumblebee.wire.operator.screen import Numbers
from bumblebee.wire.operator.terminal import Terminal
from bumblebee.wire.operator.watcher import Watcher, facts_of
from bumblebee.wire.policy_end.policy_process import READY
from bumblebee.wire.safety.guard_process import END, RECORD

_SAY, _DRAW = 0.05, 0.25  # s between two words to the guard, two pictures


@dataclass(frozen=True)
class Ended:
    """How a run ended."""

    reason: str
    """Rule that ended it; "" for good order."""
    numbers: Numbers
    told: Mapping[str, Any]
    """The guard's last word: missed ticks, refused states, what was permitted."""


def operate(
    job: Job,
    policy: Path,
    clip: Clip,
    compensation: Path | None,
    journal: Path,
    about: Mapping[str, Any],
    say: Callable[[str], None] = lambda line: None,
    watcher: Watcher | None = None,
) -> Ended:
    """Run a policy on the robot that was checked, to the end.

    Args:
        job: of the guard.
        policy: its folder.
        clip: what it follows.
        compensation: file of what is undone at the joints.
        journal: new file.
        about: what the journal's first line says.
        say: told what happens, line by line.
        watcher: who is shown the run, and may stop it.

    Raises:
        BadInput: the policy's process does not start.
    """
    with tempfile.TemporaryDirectory() as scratch, _worker(policy, clip, compensation, Path(scratch)) as end:
        say("the policy is ready")
        writer, terminal = Writer(journal, about), Terminal()
        ours, theirs = packets.pair()
        fds = (theirs.fileno(), end.fileno())
        words = [sys.executable, "-m", "bumblebee.wire.safety.guard_process", encode_job(job), *map(str, fds)]
        guard = subprocess.Popen(words, pass_fds=fds, stdin=subprocess.DEVNULL, start_new_session=True)
        theirs.close()
        end.close()
        if terminal.keys:
            say(HELP)
        try:
            with terminal.raw():
                return _attend(job, ours, writer, terminal, guard, watcher or Watcher())
        finally:
            ours.close()  # the guard damps, and ends
            guard.wait()
            writer.close()


def _attend(
    job: Job, guard: socket.socket, writer: Writer, terminal: Terminal, process: subprocess.Popen, watcher: Watcher
) -> Ended:
    """Pass on keys and records until the guard has said its last word."""
    clock, numbers = Clock(job.slow), Numbers(len(job.drives.joints))
    hand, told = Hand(clock.now()), dict[str, Any]()
    said = drawn = 0
    while True:
        now = clock.now()
        try:
            hand.press(terminal.pressed(), now)
            if watcher.wants_stop():
                hand.stop()
            if now - said >= _SAY * SECOND:
                said = now
                with suppress(packets.Gone):  # its last words are still to be read
                    packets.send(guard, encode_keys(hand.keys))
            for message in packets.received(guard):
                if message[:1] == RECORD:
                    writer.add(message[1:])
                    numbers.add(message[1:])
                elif message[:1] == END:
                    told = json.loads(message[1:])
            if now - drawn >= _DRAW * SECOND:
                drawn = now
                table = numbers.table()
                terminal.draw([*numbers.lines(table), HELP])
                watcher.show(facts_of(numbers, table, job.drives, job.plan.limits))
            select.select([guard.fileno(), *([0] if terminal.keys else [])], [], [], _SAY)
        except packets.Gone:
            break
        except KeyboardInterrupt:  # Ctrl-C is a stop key as any other
            hand.stop()
    if not told:
        process.wait()
        raise BadInput("guard", "a guard that ends in good order", f"status {process.returncode}", "The robot damps.")
    return Ended(str(told["reason"]), numbers, told)


@contextmanager
def _worker(policy: Path, clip: Clip, compensation: Path | None, scratch: Path) -> Iterator[socket.socket]:
    """The policy's process, once it is ready; gives the guard's end of its line."""
    write_library(scratch / "clips", [clip])
    ours, theirs = packets.pair()
    words = [str(policy), str(scratch / "clips"), str(compensation or ""), str(theirs.fileno())]
    process = subprocess.Popen(
        [sys.executable, "-m", "bumblebee.wire.policy_end.policy_process", *words],
        pass_fds=(theirs.fileno(),),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        start_new_session=True,
        env=os.environ | {"OMP_NUM_THREADS": "1"},
        text=True,
    )
    theirs.close()
    try:
        assert process.stdout is not None
        if process.stdout.readline().strip() != READY:
            raise BadInput(policy, "a policy that answers", f"its process ended with status {process.wait()}")
        yield ours
    finally:
        ours.close()
        with suppress(subprocess.TimeoutExpired):
            process.wait(5)
        process.kill()
        process.wait()
