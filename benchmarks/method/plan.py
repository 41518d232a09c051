"""Steps of a run: which waits for which, in the order in which they are wanted."""

from collections.abc import Sequence
from pathlib import Path

from benchmarks.method.places import (
    ARMS,
    BASE,
    GENERAL,
    LONGER,
    ONE,
    OWN,
    RANDOM,
    TOGETHER,
    Place,
    arm,
    experts,
    student,
)
from benchmarks.method.settings import Method
from benchmarks.method.students import AHEAD, changed, compared, is_student, student_of
from benchmarks.study.steps import Step

WORK = "benchmarks.method.work"
DECLARED_LINES = (LONGER, GENERAL, ONE, RANDOM)
"""Lines that no robot takes part in, each with a student."""


class Plan:
    """Collects steps.

    Args:
        out: the run's folder.
        clusters: their names.
        robots: names of the sealed robots; none: what needs no robot.
        method: the settings.
        shared: arguments of every step.
    """

    def __init__(
        self, out: Path, clusters: Sequence[str], robots: Sequence[str], method: Method, shared: tuple[str, ...]
    ) -> None:
        self.out, self.clusters, self.robots, self.method, self.shared = out, clusters, robots, method, shared
        self.steps: list[Step] = []
        self._add("train", BASE, gpu=True)
        for cluster in clusters:
            self._add("train", f"{OWN}/{cluster}", [f"train {BASE}"], gpu=True)
        for robot in robots:
            self._robot(robot)
        self._controls()
        for who in (BASE, OWN, ONE, RANDOM, LONGER):
            self._tried(who)
        for line in DECLARED_LINES:
            self._tried(student(line))
            self._tried(changed(line, AHEAD))
        for own in compared():
            self._tried(own, [])
        for robot in robots:
            for name in ARMS:
                for round_ in range(1, method.rounds + 1):
                    self._tried(Place(robot, name, round_).name, [robot])
                self._tried(student(arm(robot, name)), [robot])
                self._tried(changed(arm(robot, name), AHEAD), [robot])

    def _robot(self, robot: str) -> None:
        """All rounds of all arms on a robot."""
        first = Place(robot, "own", 1)
        self._record(first, [f"train {OWN}/{cluster}" for cluster in self.clusters])
        for round_ in range(1, self.method.rounds + 1):
            for name, parts in ARMS.items():
                place = Place(robot, name, round_)
                trained = [f"train {policy}" for policy in self._of(place.before)]
                if round_ > 1:
                    self._record(place, trained)
                needs = self._recorded(place.recorded)
                if "diagnosis" in parts:
                    needs = [self._add("diagnosis", place.recorded, needs)]
                for cluster in self.clusters:
                    own = f"{place.name}/{cluster}"
                    corrected = [self._add("delta", own, needs)] if "delta" in parts else needs
                    self._add("train", own, [*corrected, f"train {place.before}/{cluster}"], gpu=True)
        together = self._add("delta", f"{robot}/delta/r1/{TOGETHER}", self._recorded(first.recorded))
        deltas = [f"delta {robot}/{name}/r1/{cluster}" for name in ("delta", "both") for cluster in self.clusters]
        self._add("errors", first.recorded, [together, *deltas, f"diagnosis {first.recorded}"])
        for name in ARMS:
            self._distil(student(arm(robot, name)))
            self._distil(changed(arm(robot, name), AHEAD))

    def _controls(self) -> None:
        """Trainings without a round, by how much they are wanted."""
        for cluster in self.clusters:
            self._add("train", f"{LONGER}/{cluster}", [f"train {OWN}/{cluster}"], gpu=True)
        self._add("train", ONE, [f"train {BASE}"], gpu=True)
        for policy in self._of(RANDOM):
            self._add("train", policy, [f"train {BASE}"], gpu=True)
        for line in DECLARED_LINES:
            self._distil(student(line))
            self._distil(changed(line, AHEAD))
        for own in compared():
            self._distil(own)

    def _record(self, place: Place, needs: Sequence[str]) -> None:
        for shard in range(self.method.shards):
            self._add("record", place.recorded, needs, shard=shard)

    def _recorded(self, place: str) -> list[str]:
        return [f"record {place} {shard}" for shard in range(self.method.shards)]

    def _distil(self, who: str) -> None:
        teachers = sorted({f"train {policy}" for policy in self._of(student_of(who)[0])})
        self._add("distil", who, teachers, gpu=True)

    def _tried(self, who: str, robots: Sequence[str] | None = None) -> None:
        """On declared and drawn robots, and on sealed ones: those named, or all."""
        needs = [f"distil {who}"] if is_student(who) else sorted({f"train {one}" for one in self._of(who)})
        for shard in range(self.method.shards):
            self._add("tried", who, needs, shard=shard)
        for own in self.robots if robots is None else robots:
            for shard in range(self.method.shards):
                self._add("sealed", who, needs, shard=shard, robot=own)

    def _of(self, line: str) -> list[str]:
        return experts(line, self.clusters, self.method.rounds)

    def _add(
        self,
        kind: str,
        where: str,
        needs: Sequence[str] = (),
        gpu: bool = False,
        shard: int | None = None,
        robot: str | None = None,
    ) -> str:
        """Add a step unless it is there; its name."""
        parts = [part for part in (robot, None if shard is None else str(shard)) if part is not None]
        name = " ".join((kind, where, *parts))
        if all(step.name != name for step in self.steps):
            command = (WORK, kind, where, *self.shared)
            command += () if shard is None else ("--shard", str(shard))
            command += () if robot is None else ("--robot", robot)
            made = self.out / where / DONE[kind].format("-".join(parts))
            self.steps.append(Step(name, command, made, tuple(needs), gpu))
        return name


DONE = {
    "train": "done.json",
    "distil": "done.json",
    "record": "record-{}",
    "diagnosis": "diagnosis",
    "delta": "delta",
    "errors": "errors.csv",
    "tried": "tried-{}.csv",
    "sealed": "sealed-{}.csv",
}
"""File or folder of each kind of step that is there once it is done; written last."""
