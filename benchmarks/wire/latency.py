"""Latency of every stage: robot, guard and policy in processes of their own, in real time, on a long clip."""

import argparse
import os
import subprocess
import sys
import time

import psutil

from benchmarks.wire.common import lasting, shipped
from bumblebee.wire.journal import read_journal
from bumblebee.wire.rollouts import latency
from bumblebee.wire.safety.phases import Phase
from bumblebee.wire.session import Run
from bumblebee.wire.session import run as deploy


def run(options: argparse.Namespace) -> None:
    long = lasting(60 * options.minutes)
    at = str(options.out.absolute() / "sockets") if options.wire == "sim" else ""
    words = [
        sys.executable,
        "-m",
        "bumblebee",
        "deploy",
        "robot",
        "--wire",
        options.wire,
        *(["--at", at] if at else []),
    ]
    robot = subprocess.Popen(words, stdout=subprocess.PIPE, text=True)
    try:
        time.sleep(7)
        job = Run(shipped().folder, long, options.wire, options.out, at, unattended=True, operator="benchmark")
        before, begun = psutil.cpu_times(), psutil.Process(robot.pid).cpu_times().user
        ended, _ = deploy(job, print)
        busy = psutil.Process(robot.pid).cpu_times().user - begun
    finally:
        robot.terminate()
        robot.wait()
    spent = {name: now - then for name, now, then in zip(before._fields, psutil.cpu_times(), before, strict=True)}
    whole, cores = sum(spent.values()), len(os.sched_getaffinity(0))
    shares = ", ".join(f"{name} {spent[name] / whole:.1%}" for name in ("user", "system", "idle", "steal"))
    print(f"{cores} cores: {shares}; the robot {busy / whole * cores:.0%} of one")
    print(f"load {os.getloadavg()[0]:.1f}; ended by {ended.reason or 'itself'}; {', '.join(ended.told['permitted'])}")
    print("\n".join(ended.numbers.lines(ended.numbers.table())[1:]))
    newest = max((options.out / "journals").iterdir(), key=lambda path: path.stat().st_mtime)
    rows = read_journal(newest)[1]
    running = rows[rows["phase"] == Phase.RUN]
    if not len(running):
        return
    missed = running["missed"]
    print(f"run: {len(running) / 200:.0f} s, missed ticks {missed.sum()}, most in a row {missed.max()}")
    found = latency(rows)
    print(f"stamp to drives: {found}" if found else "the robot does not say which orders it took")
