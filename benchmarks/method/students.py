"""Who is distilled: the transformer of every row, and, of the experts before any round, others with one change each."""

from dataclasses import dataclass, replace

from benchmarks.method.places import OWN, student
from benchmarks.method.settings import Method
from bumblebee.learning.generalist.distill import DistillConfig
from bumblebee.tracking.config import EnvConfig, ObservationConfig
from bumblebee.tracking.presets import STUDENT


@dataclass(frozen=True)
class Student:
    """How a student is distilled."""

    told: str
    """Title of its row."""
    sees: ObservationConfig = STUDENT
    """Its observation; without terms it sees what the experts see, in an MLP that starts from the base policy."""
    times: int = 1
    """Factor on the iterations."""
    grad_norm: float = 1.0
    """Gradients are scaled down to this norm."""

    def config(self, method: Method, task: EnvConfig) -> DistillConfig:
        """Settings of its distillation in `task`."""
        own, alike = method.distil, not self.sees.terms
        return DistillConfig(
            iterations=self.times * own.iterations,
            steps=own.steps,
            learning_rate=own.rate,
            grad_norm=self.grad_norm,
            capacity=own.capacity,
            init="base" if alike else "scratch",
            model="mlp" if alike else "transformer",
            seed=method.seed,
            env=replace(task, num_worlds=own.worlds, student=self.sees),
        )


USUAL = Student("as in every row")
AHEAD = "ahead"
"""The change that every line's experts are distilled with too."""
CHANGED = {
    "exact": Student("without sensor noise", replace(STUDENT, noise=0.0)),
    AHEAD: Student(
        "also sees the reference .1 and .3 s ahead, its velocities and key bodies", replace(STUDENT, now=("imu",))
    ),
    "seeing": Student(
        "sees what the experts see; an MLP that starts from the base policy", ObservationConfig(terms=())
    ),
    "unscaled": Student("gradients scaled down to a norm of 1,000 in the place of 1", grad_norm=1000.0),
    "twice": Student("twice the iterations", times=2),
}
"""Students that differ from the usual one in one thing each."""


def changed(line: str, name: str) -> str:
    """Folder of a line's changed student."""
    return f"{student(line)}-{name}"


def compared() -> dict[str, Student]:
    """Students of the experts before any round, by folder: the usual one, and each that is changed."""
    return {student(OWN): USUAL} | {changed(OWN, name): each for name, each in CHANGED.items()}


def student_of(folder: str) -> tuple[str, Student]:
    """The line of a student's folder, and how it is distilled."""
    line, _, last = folder.rpartition("/")
    _, _, name = last.partition("-")
    return line, CHANGED[name] if name else USUAL


def is_student(folder: str) -> bool:
    """Whether a folder is of a student, and not of experts or of one policy."""
    return folder.rpartition("/")[2].startswith("student")
