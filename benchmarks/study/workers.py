"""Runs jobs of the study beside each other: trainings on GPUs, each in its own process, and trials on the cores."""

import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.study.jobs import Job, ready

GOES_ON = 3
"""Exit code of a training that kept a checkpoint when its time was over."""
_POLL = 0.5  # s


@dataclass(frozen=True)
class Places:
    """Where jobs run."""

    gpus: int
    """GPUs; 0: none, trainings run on the processor."""
    each: int
    """Trainings beside each other on a GPU: while one waits for its processor core the other computes."""
    trials: int
    """Trials beside each other, a core each."""


class Workers:
    """Trains and tries jobs until all are done or the time is over.

    Args:
        jobs: what is trained; see `jobs.ready` for the order.
        places: where.
        train: the command that trains a job in so many seconds; exit code 0: done, `GOES_ON`: later.
        trial: the command that tries a job's policy.
        logs: folder of what the processes print.
        seconds: time for all; trials that have begun are waited for.
    """

    def __init__(
        self,
        jobs: Sequence[Job],
        places: Places,
        train: Callable[[Job, float | None], list[str]],
        trial: Callable[[Job], list[str]],
        logs: Path,
        seconds: float | None,
    ) -> None:
        self.jobs, self.places, self.logs = list(jobs), places, logs
        self._train, self._trial = train, trial
        self._end = None if seconds is None else time.monotonic() + seconds
        self._lock = threading.Lock()
        self._done: set[str] = set()
        self._begun: set[str] = set()
        self._untried: list[Job] = []
        self.failed: list[str] = []
        logs.mkdir(parents=True, exist_ok=True)

    def run(self, done: set[str], tried: set[str]) -> bool:
        """Work; whether everything is done.

        Args:
            done: names of the jobs whose policies are there.
            tried: names of those whose trials are.
        """
        self._done = set(done)
        self._untried = [job for job in self.jobs if job.name in done - tried]
        slots = [str(gpu) for _ in range(self.places.each) for gpu in range(self.places.gpus)] or [""]
        threads = [threading.Thread(target=self._trainer, args=(gpu,)) for gpu in slots]
        training = list(threads)
        triers = [threading.Thread(target=self._trier, args=(training,)) for _ in range(self.places.trials)]
        for thread in [*threads, *triers]:
            thread.start()
        for thread in [*threads, *triers]:
            thread.join()
        return not self.failed and len(self._done) == len(self.jobs) and not self._untried

    def _left(self) -> float | None:
        return None if self._end is None else self._end - time.monotonic()

    def _over(self) -> bool:
        left = self._left()
        return bool(self.failed) or (left is not None and left <= 0)

    def _trainer(self, gpu: str) -> None:
        while not self._over():
            with self._lock:
                if len(self._done) == len(self.jobs):
                    return
                job = ready(self.jobs, self._done, self._begun)
                if job is not None:
                    self._begun.add(job.name)
            if job is None:
                if len(self._begun | self._done) == len(self.jobs):
                    return
                time.sleep(_POLL)
                continue
            code = self._call(self._train(job, self._left()), f"{job.name}.train.log", {"CUDA_VISIBLE_DEVICES": gpu})
            with self._lock:
                if code == 0:
                    self._done.add(job.name)
                    self._untried.append(job)
                elif code == GOES_ON:
                    return
                else:
                    self.failed.append(job.name)

    def _trier(self, training: Sequence[threading.Thread]) -> None:
        while True:
            with self._lock:
                job = self._untried.pop(0) if self._untried and not self._over() else None
            if job is None:
                if self._over() or not any(thread.is_alive() for thread in training):
                    return
                time.sleep(_POLL)
                continue
            code = self._call(self._trial(job), f"{job.name}.trial.log", {"CUDA_VISIBLE_DEVICES": ""})
            if code:
                with self._lock:
                    self.failed.append(job.name)

    def _call(self, command: list[str], log: str, variables: dict[str, str]) -> int:
        environment = os.environ | variables | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        with (self.logs / log).open("a") as file:
            return subprocess.run(
                [sys.executable, "-m", *command], stdout=file, stderr=subprocess.STDOUT, env=environment, check=False
            ).returncode
