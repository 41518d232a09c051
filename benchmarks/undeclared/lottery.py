"""The suite: which cases there are, frozen by its seed and each case's number, and the draw of one case.

The list is a function of `Suite` alone; `Suite.digest` is the hash of it. What a case draws (places, signs, sizes,
motions, noise) comes from (seed, number) and from nothing that a diagnosis did.
"""

import hashlib
import json
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from bumblebee.stand_in.undeclared.kinds import CATALOGUE, KINDS, LATER, OUTSIDE, fits

VERSION = 9  # of what a case's number means; a change of kinds, robots, motions or sizes raises it


@dataclass(frozen=True)
class Case:
    """One case to draw."""

    number: int
    robot: str
    """arm, stand (the humanoid of this process, balancing) or track (the G1 under a policy)."""
    group: str
    """single, pair, triple, null, outside."""
    kinds: tuple[str, ...]
    ratio: float
    """Size in units of the minimal detectable one."""
    noise: float
    """Times the sensors' noise."""
    rollouts: int
    rivals: bool
    """Whether the other methods run, too."""


@dataclass(frozen=True)
class Suite:
    """All cases of a seed."""

    seed: int = 1

    def cases(self) -> list[Case]:
        """In an order whose every beginning is a mixed sample; what came later is behind, so that numbers stay."""
        rng = np.random.default_rng([self.seed, 1])
        strata = [_nulls(), *_singles(), *_several(rng), *_outside()]
        placed = []
        for index, stratum in enumerate(strata):
            order = rng.permutation(len(stratum))
            placed += [((k + 0.5) / len(stratum), index, stratum[i]) for k, i in enumerate(order)]
        placed.sort(key=lambda p: p[:2])
        rows = [row for _, _, row in placed] + _later()
        return [Case(number, **row) for number, row in enumerate(rows)]

    def digest(self) -> str:
        """First 16 hexadecimal digits of the sha256 of version, seed and list."""
        rows = [VERSION, self.seed, [asdict(case) for case in self.cases()]]
        return hashlib.sha256(json.dumps(rows, sort_keys=True).encode()).hexdigest()[:16]


def _row(robot: str, group: str, kinds: tuple[str, ...] = (), ratio: float = 0.0, **rest: Any) -> dict[str, Any]:
    return {"robot": robot, "group": group, "kinds": kinds, "ratio": ratio, "noise": 1.0, "rollouts": 4,
            "rivals": False} | rest  # fmt: skip


def _nulls() -> list[dict[str, Any]]:
    rows = [
        _row("arm", "null", noise=noise, rollouts=rollouts)
        for noise in (1.0, 3.0)
        for rollouts in (1, 4, 8)
        for _ in range(9)
    ]
    rows += [
        _row("stand", "null", noise=noise, rollouts=r) for noise in (1.0, 3.0) for r in (1, 4, 8) for _ in range(3)
    ]
    rows += [_row("track", "null", noise=noise) for noise in (1.0, 3.0) for _ in range(3)]
    return rows


def _singles() -> list[list[dict[str, Any]]]:
    """At 5 times the detectable size in all conditions; at 2 and 20 times in the plain one."""
    five, others = [], []
    for kind in CATALOGUE:
        robots = [robot for robot in ("arm", "stand", "track") if fits(kind, robot)]
        for robot in robots:
            name = (kind.name,)
            five.append(_row(robot, "single", name, 5.0, rivals=robot == "arm"))
            others.append(_row(robot, "single", name, 20.0, rivals=robot == "stand"))
            if robot == "track":
                continue
            five.append(_row(robot, "single", name, 5.0, noise=3.0, rollouts=8))
            others.append(_row(robot, "single", name, 2.0))
            others.append(_row(robot, "single", name, 5.0, rollouts=1))
            if robot == "arm":
                five += [_row(robot, "single", name, 5.0, rollouts=8), _row(robot, "single", name, 5.0, noise=3.0)]
                others += [_row(robot, "single", name, 2.0, rollouts=8), _row(robot, "single", name, 20.0, noise=3.0)]
    return [five, others]


def _several(rng: np.random.Generator) -> list[list[dict[str, Any]]]:
    """Pairs and triples of different kinds at 10 times the detectable size."""

    def some(robot: str, size: int) -> tuple[str, ...]:
        names = [kind.name for kind in CATALOGUE if fits(kind, robot)]
        return tuple(str(n) for n in rng.choice(names, size, replace=False))

    counts = {"arm": (30, 15), "stand": (12, 6), "track": (4, 2)}
    pairs = [
        _row(r, "pair", some(r, 2), 10.0, rivals=r == "arm" and i % 2 == 0)
        for r, (n, _) in counts.items()
        for i in range(n)
    ]
    triples = [_row(r, "triple", some(r, 3), 10.0) for r, (_, n) in counts.items() for i in range(n)]
    return [pairs, triples]


def _outside() -> list[list[dict[str, Any]]]:
    rows = []
    for kind in OUTSIDE:
        for robot in ("arm", "stand"):
            if fits(kind, robot):
                rows += [_row(robot, "outside", (kind.name,), ratio, rivals=robot == "arm" and ratio == 20.0)
                         for ratio in ((10.0, 20.0, 40.0) if robot == "arm" else (20.0,))]  # fmt: skip
    return [rows]


def _later() -> list[dict[str, Any]]:
    """Kinds that came after the others were numbered, alone at 5, 20 and 2 times the detectable size."""
    rows = []
    for kind in LATER:
        for ratio in (5.0, 20.0, 2.0):
            robots = [robot for robot in ("arm", "stand", "track") if fits(kind, robot)]
            rows += [_row(robot, "single", (kind.name,), ratio) for robot in robots]
            rows += [_row("arm", "single", (kind.name,), ratio, noise=3.0, rollouts=8)]
            rows += [_row("arm", "single", (kind.name,), ratio, rollouts=1)]
    return rows


def draw_signs(kind: str, robot_joints: tuple[str, ...], rng: np.random.Generator) -> dict[str, Any]:
    """Properties that a size leaves open."""
    assert kind in KINDS
    return {
        "sign": int(rng.choice([-1, 1])),
        "axis": int(rng.integers(3)),
        "number": int(rng.integers(4, 13)),
        "other": str(rng.choice(robot_joints)),
    }
