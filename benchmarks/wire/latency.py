"""Latency of every stage: robot, guard and policy in processes of their own, in real time, on a long clip."""

import argparse
import os
import subprocess
import sys
import time
from dataclasses import replace

import numpy as np

from benchmarks.wire.common import clips, shipped
from bumblebee.wire.journal import read_journal
from bumblebee.wire.phases import Phase
from bumblebee.wire.rollouts import latency
from bumblebee.wire.session import Run
from bumblebee.wire.session import run as deploy


def run(options: argparse.Namespace) -> None:
    clip = clips(["arm_circles"])[0]  # begins and ends in the relaxed stand
    times = max(1, round(60 * options.minutes / clip.duration))
    arrays = ("root_pos", "root_quat", "joint_pos", "key_pos")
    long = replace(clip, **{name: np.concatenate([getattr(clip, name)] * times) for name in arrays})
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
        time.sleep(8)
        job = Run(shipped().folder, long, options.wire, options.out, at, unattended=True, operator="benchmark")
        ended, _ = deploy(job, print)
    finally:
        robot.terminate()
        robot.wait()
    print(f"{len(os.sched_getaffinity(0))} cores; load {os.getloadavg()[0]:.1f}; ended by {ended.reason or 'itself'}")
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
