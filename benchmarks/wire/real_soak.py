"""Faults in real time: robot, guard, policy and console as processes, stopped and killed at random, one fault a run.

Each fault is a line of `soak.jsonl` in the output folder: a soak that goes on another day begins where it ended, and
its lines are added up. Draws follow from the seed and the line's number.
"""

import argparse
import json
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import psutil

from benchmarks.lab_soak.record import Record, read
from benchmarks.wire.common import shipped
from benchmarks.wire.soak_judge import KILLS, KINDS, judged, lost, must_damp
from benchmarks.wire.soak_told import told
from bumblebee.robot.facts import joint_names
from bumblebee.wire.journal import layout, read_journal
from bumblebee.wire.links.lcm_codec import Codec
from bumblebee.wire.links.link import Link, open_link
from bumblebee.wire.messages import ORDER, STATE
from bumblebee.wire.safety.phases import Phase

_PATIENCE = 240.0  # s for a run to begin, and to end
_CLIP = 15.0  # s: longer than any fault and the wait before it


def run(options: argparse.Namespace) -> None:
    """Faults for so many minutes, beside those that the file has already."""
    options.out.mkdir(parents=True, exist_ok=True)
    policy, record, end = shipped().folder, Record(options.out / "soak.jsonl"), time.monotonic() + 60 * options.minutes
    rows = read(record.path) if record.path.exists() else []
    robot = Robot(options.wire, options.seed)
    try:
        while time.monotonic() < end:
            rows.append(record.write("fault", number=len(rows), **fault(robot, policy, options, len(rows))))
            print(json.dumps(rows[-1]), flush=True)
    finally:
        robot.end()
    print("\n".join(told(rows)))


class Robot:
    """The robot's process, begun anew where it is gone."""

    def __init__(self, wire: str, seed: int) -> None:
        self._words = [sys.executable, "-m", "benchmarks.wire.faulty_robot", wire, str(seed)]
        self._process: subprocess.Popen[str] | None = None

    def there(self) -> psutil.Process:
        """The process, alive and on the wire."""
        if self._process is None or self._process.poll() is not None:
            pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
            self._process = subprocess.Popen(self._words, text=True, **pipes)
            assert self._process.stdout is not None
            self._process.stdout.readline()
        return psutil.Process(self._process.pid)

    def tell(self, words: str) -> None:
        """Write a line to its standard input."""
        assert self._process is not None and self._process.stdin is not None
        print(words, file=self._process.stdin, flush=True)

    def end(self) -> None:
        """Kill it."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()


def fault(robot: Robot, policy: Path, options: argparse.Namespace, number: int) -> dict[str, Any]:
    """One run with one fault; what came of it."""
    rng = np.random.default_rng([options.seed, number])
    kind, wait = str(rng.choice(KINDS)), float(rng.uniform(0.2, 2.0))
    lasts = float(np.exp(rng.uniform(np.log(0.05), np.log(5.0))))
    facts: dict[str, Any] = {"kind": kind, "lasts": round(lasts, 3), "must": must_damp(kind, lasts)}
    folder, machine = options.out / f"run-{number}", robot.there()
    shutil.rmtree(folder, ignore_errors=True)
    words = [sys.executable, "-m", "benchmarks.wire.soak_run", str(policy), options.wire, str(folder), str(_CLIP)]
    clock = time.monotonic()
    with open_wire(options.wire) as link, (options.out / "last-run.txt").open("w") as said:
        console = subprocess.Popen(words, stdout=said, stderr=said)
        journal = running(console, folder)
        if journal is None:  # refused, or ended before the policy ran
            machine.kill()
            return facts | {"early": "it did not begin"}
        time.sleep(wait)
        begun, processes = time.monotonic_ns(), {"robot": machine, **children(console.pid)}
        if "guard" not in processes or "policy" not in processes or console.poll() is not None:
            return facts | {"early": f"it ended before, status {console.wait(_PATIENCE)}", "seconds": since(clock)}
        link.received()
        strike(kind, lasts, processes, robot)
        heard = listened(link, lasts + 1.0)
        mend(kind, processes)
        status = ended(console, processes)
    orders = [CODEC.order(message) for channel, message in heard if channel == ORDER]
    states = [CODEC.state(message) for channel, message in heard if channel == STATE]
    rows = read_journal(journal)[1]
    made = judged(kind, begun, rows, orders, states)
    before = rows["phase"][rows["sent_ns"] < begun]
    facts |= {"early": "a rule ended it before the fault"} if (before >= Phase.DAMP).any() else {}
    facts |= asdict(made) | {"status": status, "seconds": since(clock), "missed": int(rows["missed"].sum())}
    facts |= {"lost": lost(begun, rows)} if kind in KILLS else {}
    shutil.rmtree(folder, ignore_errors=True)
    return facts


CODEC = Codec(len(joint_names()))


@contextmanager
def open_wire(wire: str) -> Iterator[Link]:
    """A listener to orders and states."""
    link = open_link(wire, [STATE, ORDER])
    try:
        yield link
    finally:
        link.close()


def running(console: subprocess.Popen, folder: Path) -> Path | None:
    """The run's journal once the policy carries the robot; None where it ended before."""
    end, size = time.monotonic() + _PATIENCE, layout(len(joint_names())).itemsize
    while console.poll() is None and time.monotonic() < end:
        time.sleep(0.05)
        for journal in (folder / "journals").glob("*.journal"):
            content = journal.read_bytes()
            whole = len(content.partition(b"\n")[2]) // size
            if whole and read_journal(journal)[1]["phase"][-1] == Phase.RUN:
                return journal
    console.kill()
    console.wait()
    return None


def children(console: int) -> dict[str, psutil.Process]:
    """Guard and policy of a console."""
    found = {}
    for process in psutil.Process(console).children():
        words = " ".join(process.cmdline())
        found |= {name: process for name in ("guard", "policy") if f"{name}_process" in words}
    return found | {"console": psutil.Process(console)}


def strike(kind: str, lasts: float, processes: dict[str, psutil.Process], robot: Robot) -> None:
    """Begin a fault."""
    whom, what = kind.split()[0], kind.split()[-1]
    if whom == "states":
        robot.tell(f"{'nan' if what == 'numbers' else 'burst'} {lasts}")
    else:
        processes[whom].send_signal(signal.SIGKILL if what == "killed" else signal.SIGSTOP)


def mend(kind: str, processes: dict[str, psutil.Process]) -> None:
    """Let whoever was stopped go on."""
    if kind.endswith("stopped"):
        processes[kind.split()[0]].send_signal(signal.SIGCONT)


def listened(link: Link, seconds: float) -> list[tuple[str, bytes]]:
    """All that is said for a time."""
    heard, end = [], time.monotonic() + seconds
    while time.monotonic() < end:
        link.wait(0.02)
        heard += link.received()
    return heard


def ended(console: subprocess.Popen, processes: dict[str, psutil.Process]) -> int:
    """Status of the console once all three are gone; what is not by itself is killed."""
    gone, _ = psutil.wait_procs([processes["guard"], processes["policy"]], timeout=_PATIENCE)
    for process in {processes["guard"], processes["policy"]} - set(gone):
        process.kill()
    try:
        return console.wait(_PATIENCE)
    except subprocess.TimeoutExpired:
        console.kill()
        return console.wait()


def since(begun: float) -> float:
    """Seconds since then."""
    return round(time.monotonic() - begun, 1)
