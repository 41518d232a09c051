"""Names of what a run makes, which are also its folders: lines of experts, rounds on robots, students."""

from collections.abc import Sequence
from dataclasses import dataclass

BASE = "base"
OWN, LONGER, RANDOM, ONE = (f"declared/{name}" for name in ("own", "longer", "random", "one"))
"""Experts by cluster before any round, the same with the rounds' steps but no correction, experts of random clusters,
and one policy; the last three have as many iterations as the method in all."""
GENERAL = "declared/general"
"""The line of the student that learns from the base policy alone."""
ARMS: dict[str, tuple[str, ...]] = {"delta": ("delta",), "physics": ("diagnosis",), "both": ("diagnosis", "delta")}
"""Corrections of the simulator in each arm; `delta` is the paper's."""
TOGETHER = "all"
"""Where a cluster's name would be: the delta action of all clusters."""


@dataclass(frozen=True)
class Place:
    """An arm's round on a robot."""

    robot: str
    arm: str
    round: int

    @property
    def name(self) -> str:
        """Folder below the run's; it holds a folder for each cluster."""
        return f"{self.robot}/{self.arm}/r{self.round}"

    @property
    def recorded(self) -> str:
        """Folder of this round's recordings and diagnosis: the first round's are shared by all arms."""
        return f"{self.robot}/own/r1" if self.round == 1 else self.name

    @property
    def before(self) -> str:
        """The experts that the round starts from."""
        return OWN if self.round == 1 else Place(self.robot, self.arm, self.round - 1).name

    @classmethod
    def of(cls, name: str) -> "Place":
        """From its folder, or from that of a cluster in it."""
        robot, arm, round_ = name.split("/")[:3]
        return cls(robot, arm, int(round_[1:]))


def arm(robot: str, name: str) -> str:
    """The line of an arm on a robot, which ends in its student."""
    return f"{robot}/{name}"


def experts(line: str, clusters: Sequence[str], rounds: int) -> list[str]:
    """Folders of the policies at a line's end, one for each cluster.

    Args:
        line: see above.
        clusters: their names; in the line `RANDOM` its own are r0, r1 ...
        rounds: of the method.
    """
    if line in (BASE, GENERAL, ONE):
        return [ONE if line == ONE else BASE] * len(clusters)
    if line == RANDOM:
        return [f"{RANDOM}/r{index}" for index in range(len(clusters))]
    last = line if line in (OWN, LONGER) or line.count("/") > 1 else f"{line}/r{rounds}"
    return [f"{last}/{cluster}" for cluster in clusters]


def student(line: str) -> str:
    """Folder of the policy that is distilled from a line's experts."""
    return f"{line}/student"
