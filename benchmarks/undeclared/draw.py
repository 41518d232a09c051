"""One case drawn: the true robot's laws with their sizes, its flights, and rollouts with noise."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.undeclared.detectable import CHI2, Eye, chi_square, make_eye, minimal_size
from benchmarks.undeclared.excite import HZ, Plan, make_plan
from benchmarks.undeclared.flight import Flight, fly, rollouts
from benchmarks.undeclared.lottery import Case, draw_signs
from benchmarks.undeclared.robots import declared
from bumblebee.measured.rollout import Rollout
from bumblebee.stand_in.undeclared.declared import Declared
from bumblebee.stand_in.undeclared.kinds import KINDS, Place, places
from bumblebee.stand_in.undeclared.law import Law

SECONDS = {"arm": 5.0, "stand": 6.0, "track": 6.0}
JUDGES = 3  # rollouts that no method sees, for the error
_PLACES = 8  # tries to find a place where the wanted size is still this robot
_LARGER, _GROWTH, _HALF = 4, 1.3, 0.5  # tries to find a size that is seen, each so much larger; share that is asked


@dataclass(frozen=True, eq=False)
class Drawn:
    """A case ready to be diagnosed."""

    robot: Declared
    truth: list[dict[str, Any]]
    """The contract's entries (effect, where, parameters), with nominal values, size, minimal size and ratio."""
    shown: list[Rollout]
    """Rollouts that every method gets."""
    judge: list[Rollout]
    """Rollouts that only the judge gets."""


def draw(case: Case, seed: int, policy: Path | None = None) -> Drawn:
    """Draw the case `case` of the suite with `seed`; `policy` is needed where the G1 tracks motions."""
    rng = np.random.default_rng([seed, case.number, 7])
    robot = declared(case.robot)
    seeds = [int(s) for s in rng.integers(1 << 31, size=6)]

    def plan(which: int, count: int) -> Plan:
        return make_plan(robot, count, SECONDS[case.robot], np.random.default_rng(seeds[which]), policy)

    def run(laws: list[Law], which: int = 0, count: int = case.rollouts) -> Flight:
        return fly(robot, laws, plan(which, count), np.random.default_rng(seeds[2 + which]))

    truth: list[dict[str, Any]] = []
    laws: list[Law] = []
    if case.kinds:
        null = run([])
        eye = make_eye(robot, null, case.noise, np.random.default_rng(seeds[4]))
        for name in case.kinds:
            entry, law = draw_one(name, case, robot, null, eye, run, rng)
            truth.append(entry)
            laws.append(law)
    noise = np.random.default_rng(seeds[5])
    shown = rollouts(robot, run(laws), case.noise, noise, "r")
    judge = rollouts(robot, run(laws, 1, JUDGES), case.noise, noise, "j")
    return Drawn(robot, truth, shown, judge)


def draw_one(
    name: str, case: Case, robot: Declared, null: Flight, eye: Eye, run: Any, rng: np.random.Generator
) -> tuple[dict[str, Any], Law]:
    """A place where the wanted size is possible, or of those tried the one that comes nearest."""
    kind = KINDS[name]
    names = list(rng.permutation(places(kind, robot)))[:_PLACES]
    best: tuple[float, Place, float, float] | None = None
    for where in names:
        place = _place(str(where), kind.name, robot, null, rng)
        first, most = kind.first(place), kind.most(place)
        make = lambda size, place=place: run([kind.make(place, size)[0]])  # noqa: E731
        least = minimal_size(eye, make, first, most, kind.least(place))
        least = max(least, kind.events / max(float(null.alive.sum()), 1.0))
        size = float(np.clip(case.ratio * least, kind.least(place), most))
        if kind.least(place) > 0:
            size = _shown(eye, make, size, most, min(case.ratio, size / least))
        ratio = size / least if np.isfinite(least) else 0.0
        if best is None or ratio > best[0]:
            best = (ratio, place, size, least)
        if ratio > 0.7 * case.ratio:
            break
    ratio, place, size, least = best
    law, parameters = kind.make(place, size)
    _, nominal = kind.make(place, 1e-9 * kind.first(place))
    entry = {
        "effect": name,
        "where": [place.name] if place.name else [],
        "parameters": {k: float(v) for k, v in parameters.items()},
        "nominal": {k: float(v) for k, v in nominal.items()},
        "draw": place.draw,
        "size": size,
        "minimal": least if np.isfinite(least) else None,
        "ratio": ratio,
        "group": kind.group,
    }
    return entry, law


def _shown(eye: Eye, make: Callable[[float], Flight], size: float, most: float, ratio: float) -> float:
    """The size, or the next larger one at which an effect that may swing shows as half of `ratio` says it should.

    A stiff shaft that swings can be seen where one half as stiff, which does not, is not.
    """
    for _ in range(_LARGER):
        if size >= most or chi_square(eye, make(size)) >= CHI2 * (_HALF * ratio) ** 2:
            break
        size = min(_GROWTH * size, most)
    return size


def _place(where: str, name: str, robot: Declared, null: Flight, rng: np.random.Generator) -> Place:
    signs = draw_signs(name, robot.joints, rng)
    if where not in robot.joints:
        return Place(robot, where, signs)
    others = [joint for joint in robot.joints if joint != where]
    signs["other"] = str(rng.choice(others))
    j = robot.joints.index(where)
    joints = len(robot.joints)
    torque = float(np.abs(null.torque[..., j]).max())
    rate = float(np.abs(np.diff(null.target[..., j], axis=0)).max()) * HZ
    return Place(robot, where, signs, torque, float(np.abs(null.qvel[..., -joints + j]).max()), rate)
