"""The faults: which, when by a seed, and how each is done and undone."""

import random
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

from benchmarks.kills.processes import find
from benchmarks.lab_soak import stand as stands
from benchmarks.lab_soak.loops import Running, hit
from benchmarks.lab_soak.record import Record

WORKER = "worker killed"
OTHERS = (
    "database killed",
    "S3 ended",
    "S3 answers nothing",
    "worker's disk full",
    "workspace's disk full",
    "keeper killed",
    "flow killed",
    "Prefect's server killed",
    "MLflow's server killed",
)
LASTS = {
    **dict.fromkeys(OTHERS, 0.0),
    WORKER: 20.0,
    "database killed": 10.0,
    "S3 ended": 60.0,
    "S3 answers nothing": 60.0,
    "worker's disk full": 60.0,
    "workspace's disk full": 60.0,
}
"""Seconds until what was taken away is given back."""
PROCESSES = {
    "keeper killed": ("flows.demo",),
    "flow killed": ("flows.walk",),
    "Prefect's server killed": ("flows.servers.front", "prefect"),
    "MLflow's server killed": ("flows.servers.front", "mlflow"),
}
PATIENCE = 90.0  # [s] that a fault waits for the process that it hits


@dataclass(frozen=True)
class Fault:
    """One that is to come."""

    at: float
    """Seconds from the beginning."""
    kind: str
    target: int
    """Number of the worker, for those that hit one."""


def schedule(seed: int, seconds: float, workers_every: float, others_every: float, workers: int) -> list[Fault]:
    """A worker is killed every so often; of the others each kind comes once before any comes again.

    Args:
        seed: of the draw.
        seconds: length of the soak.
        workers_every: seconds between two workers that are killed.
        others_every: seconds between two others; each comes up to a quarter of this later.
        workers: their number.
    """
    draw = random.Random(seed)
    times = range(1, int(seconds / workers_every) + 1)
    found = [Fault(number * workers_every, WORKER, draw.randrange(workers)) for number in times]
    waiting: list[str] = []
    for number in range(1, int(seconds / others_every) + 1):
        if not waiting:
            waiting = draw.sample(OTHERS, len(OTHERS))
        late = draw.uniform(0, others_every / 4)
        found.append(Fault(number * others_every + late, waiting.pop(), draw.randrange(workers)))
    return sorted((fault for fault in found if fault.at < seconds), key=lambda fault: fault.at)


class Injector(threading.Thread):
    """Does what the schedule says, beside the loops; `stop` ends it after the fault that lasts."""

    def __init__(self, faults: list[Fault], stand: stands.Stand, now: Running, record: Record) -> None:
        super().__init__(daemon=True, name="faults")
        self.faults, self.stand, self.now, self.record = faults, stand, now, record
        self.over = threading.Event()
        self.began = time.monotonic()

    def run(self) -> None:
        """One fault after the other."""
        for fault in self.faults:
            if self.over.wait(max(0.0, fault.at - (time.monotonic() - self.began))):
                return
            try:
                self.inject(fault)
            except Exception as error:  # a fault that fails must not end the others, and is judged
                self.record.write("fault failed", kind=fault.kind, error=f"{type(error).__name__}: {error}"[:500])

    def inject(self, fault: Fault) -> None:
        """Take something away, wait, give it back."""
        if fault.kind in PROCESSES:
            end = time.monotonic() + PATIENCE
            while not hit(self.now, lambda pid: find(pid, PROCESSES[fault.kind])):
                if time.monotonic() > end or self.over.wait(0.5):
                    self.record.write("fault missed", kind=fault.kind)
                    return
            self.record.write("fault", kind=fault.kind)
            self.record.write("restored", kind=fault.kind)
            return
        take, give = self.ways(fault)
        self.record.write("fault", kind=fault.kind, target=fault.target)
        take()
        self.over.wait(LASTS[fault.kind])
        give()
        self.record.write("restored", kind=fault.kind)

    def ways(self, fault: Fault) -> tuple[Callable[[], object], Callable[[], object]]:
        """How the fault is done and undone."""
        here, own = self.stand, self.stand.folder / f"worker{fault.target}"
        return {
            WORKER: (lambda: here.kill_worker(fault.target), lambda: here.start_worker(fault.target)),
            "database killed": (here.postgres.kill, here.postgres.start),
            "S3 ended": (here.seaweed.kill, here.seaweed.start),
            "S3 answers nothing": (here.seaweed.freeze, here.seaweed.thaw),
            "worker's disk full": (lambda: stands.fill(own), lambda: stands.empty(own)),
            "workspace's disk full": (lambda: stands.fill(here.loops), lambda: stands.empty(here.loops)),
        }[fault.kind]
