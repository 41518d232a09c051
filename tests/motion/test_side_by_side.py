"""Work in several processes keeps the items' order, runs little ahead, and leaves no process behind."""

import math
import operator
import os
import signal
import subprocess
import sys
from pathlib import Path

import psutil
import pytest

from bumblebee.motion.side_by_side import in_order

KILLED = """
import multiprocessing, time
from bumblebee.motion.side_by_side import in_order

def items():
    for number in range(40):
        if number == 10:  # the processes work
            print(*[child.pid for child in multiprocessing.active_children()], flush=True)
        yield 0.0 if number < 8 else 60.0

if __name__ == "__main__":
    list(in_order(time.sleep, items(), 2))
"""

INTERRUPTED = """
import sys, time
from bumblebee.last_line import guarded
from bumblebee.motion.side_by_side import in_order

def items():
    for number in range(40):
        if number == 12:
            print("working", flush=True)
        yield 0.0 if number < 8 else 600.0

if __name__ == "__main__":
    sys.exit(guarded(lambda: list(in_order(time.sleep, items(), 2))))
"""


@pytest.mark.parametrize("processes", [1, 2])
@pytest.mark.parametrize("count", [0, 1, 7, 8, 40])
def test_results_come_in_the_order_of_the_items(processes, count):
    assert list(in_order(operator.neg, range(count), processes)) == [-number for number in range(count)]


def test_a_process_computes_on_one_core(monkeypatch):
    """Those that use all cores for a matrix wait for each other: beside two of them a motion took 70 s, not 0.5."""
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    assert set(in_order(os.getenv, ["OMP_NUM_THREADS"] * 12, 2)) == {"1"}


@pytest.mark.parametrize("processes", [1, 2])
def test_an_exception_passes_after_the_results_before_it(processes):
    results = in_order(math.sqrt, [4.0] * 12 + [-1.0] * 12, processes)
    assert [next(results) for _ in range(12)] == [2.0] * 12
    with pytest.raises(ValueError, match="math domain error"):
        next(results)


def test_items_are_taken_only_as_there_is_room():
    taken = 0

    def items():
        nonlocal taken
        for number in range(1000):
            taken += 1
            yield number

    results = in_order(operator.neg, items(), 2)
    assert [next(results) for _ in range(50)][-1] == -49
    assert taken <= 50 + 8
    results.close()
    assert taken <= 50 + 8


def test_an_interrupted_parent_waits_for_no_process(tmp_path: Path):
    """Ctrl-C is the parent's alone, and its workers would work for minutes yet."""
    script = tmp_path / "parent.py"
    script.write_text(INTERRUPTED)
    parent = subprocess.Popen([sys.executable, str(script)], stdout=subprocess.PIPE, text=True)
    try:
        assert parent.stdout is not None and parent.stdout.readline() == "working\n"
        parent.send_signal(signal.SIGINT)
        assert parent.wait(timeout=60) == 130
    finally:
        parent.kill()
        parent.wait()


def test_no_process_outlives_a_parent_that_is_killed(tmp_path: Path):
    script = tmp_path / "parent.py"
    script.write_text(KILLED)
    parent = subprocess.Popen([sys.executable, str(script)], stdout=subprocess.PIPE, text=True)
    try:
        assert parent.stdout is not None
        children = [psutil.Process(int(pid)) for pid in parent.stdout.readline().split()]
    finally:
        parent.send_signal(signal.SIGKILL)
        parent.wait()
    assert len(children) == 2
    _, alive = psutil.wait_procs(children, timeout=20)
    assert all(process.status() == psutil.STATUS_ZOMBIE for process in alive)
