"""Runs steps of a run beside each other, each a process of its own: on GPUs, or on the cores."""

import math
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from pathlib import Path

GOES_ON = 3
"""Exit code of a step that kept a checkpoint when its time was over."""
_POLL = 0.5  # s


@dataclass(frozen=True)
class Step:
    """One process of a run."""

    name: str
    command: tuple[str, ...]
    """Module and its arguments."""
    done: Path
    """File that is there once the step is done; written last."""
    needs: tuple[str, ...] = ()
    """Names of the steps whose results it reads."""
    gpu: bool = False
    """Whether it has a GPU where there is one; it is then told the seconds left, and ends in time by itself."""


@dataclass(frozen=True)
class Places:
    """Where steps run."""

    gpus: int
    """GPUs; 0: none, what would have one runs on the processor."""
    each: int
    """Steps beside each other on a GPU: while one waits for its processor core the other computes."""
    cores: int
    """Steps without a GPU beside each other, a core each."""


def deadline(seconds: float | None) -> Callable[[], bool]:
    """Says when so many seconds are over; never without."""
    end = math.inf if seconds is None else time.monotonic() + seconds
    return lambda: time.monotonic() > end


def ready(steps: Sequence[Step], done: set[str], begun: set[str], gpu: bool) -> Step | None:
    """The first step of a kind that is neither done nor begun and whose needs are done."""
    for step in steps:
        if step.gpu == gpu and step.name not in done | begun and done.issuperset(step.needs):
            return step
    return None


class Runner:
    """Does steps until all are done, one fails or the time is over.

    Args:
        steps: what is done; of those that could begin, the first does.
        places: where.
        logs: folder of what the processes print.
        seconds: time for all; steps without a GPU that have begun are waited for.
    """

    def __init__(self, steps: Sequence[Step], places: Places, logs: Path, seconds: float | None) -> None:
        self.steps, self.places, self.logs = list(steps), places, logs
        self._end = None if seconds is None else time.monotonic() + seconds
        self._lock = threading.Lock()
        self._done: set[str] = set()
        self._begun: set[str] = set()
        self._running: set[str] = set()
        self.failed: list[str] = []
        logs.mkdir(parents=True, exist_ok=True)

    def run(self, known: AbstractSet[str] = frozenset()) -> bool:
        """Work; whether everything is done. `known` are other steps that are done, which these may need."""
        self._done = {step.name for step in self.steps if step.done.exists()} | known
        slots = [str(gpu) for _ in range(self.places.each) for gpu in range(self.places.gpus)] or [""]
        threads = [threading.Thread(target=self._work, args=(True, gpu)) for gpu in slots]
        threads += [threading.Thread(target=self._work, args=(False, "")) for _ in range(self.places.cores)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        return not self.failed and all(step.name in self._done for step in self.steps)

    def _left(self) -> float | None:
        return None if self._end is None else self._end - time.monotonic()

    def _work(self, on_gpu: bool, gpu: str) -> None:
        while not self.failed:
            left = self._left()
            with self._lock:
                step = self._next(on_gpu, left)
                if step is None and not self._running and self._next(not on_gpu, left) is None:
                    return  # nothing runs or begins that another step could wait for
                if step is not None:
                    self._begun.add(step.name)
                    self._running.add(step.name)
            if step is None:
                time.sleep(_POLL)
                continue
            code = self._call(step, gpu, left)
            with self._lock:
                self._running.remove(step.name)
                if code == 0:
                    self._done.add(step.name)
                elif code != GOES_ON:
                    self.failed.append(step.name)

    def _next(self, on_gpu: bool, left: float | None) -> Step | None:
        over = left is not None and left <= 0
        return None if over else ready(self.steps, self._done, self._begun, on_gpu)

    def _call(self, step: Step, gpu: str, left: float | None) -> int:
        """The step's exit code."""
        variables = {"CUDA_VISIBLE_DEVICES": gpu, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        seconds = ["--seconds", f"{left:.1f}"] if step.gpu and left is not None else []
        with (self.logs / f"{step.name.replace('/', '.')}.log").open("a") as file:
            return subprocess.run(
                [sys.executable, "-m", *step.command, *seconds],
                stdout=file, stderr=subprocess.STDOUT, env=os.environ | variables, check=False,
            ).returncode  # fmt: skip
