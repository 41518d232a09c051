"""The effects that a plan asks about: those found, those that data take for them, and the usual ones of any robot."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bumblebee.diagnosis.candidates import INVERSE, Candidate, all_candidates
from bumblebee.diagnosis.plan.findings import Finding, Findings
from bumblebee.diagnosis.simulation import Plant
from bumblebee.diagnosis.thresholds import Thresholds
from bumblebee.measured.rollout import Rollout


@dataclass(frozen=True, eq=False)
class Basis:
    """Candidates whose columns are computed; K rows, one a free parameter, of a candidate after the other."""

    candidates: tuple[Candidate, ...]
    sizes: tuple[np.ndarray, ...]
    """Size of each candidate (F,) in the steps of its rows; ones where nothing is known."""
    found: dict[int, Finding]
    """Candidate -> what a diagnosis says of it."""
    usual: tuple[int, ...]
    """Candidates that are fitted together on each joint."""
    unasked: tuple[str, ...] = ()
    """Findings without a candidate: what they predict is not known here."""

    @property
    def slices(self) -> list[slice]:
        """Rows of each candidate."""
        ends = np.cumsum([len(c.free) for c in self.candidates]).tolist()
        return [slice(end - len(c.free), end) for c, end in zip(self.candidates, ends, strict=True)]

    def index(self, effect: str, where: str) -> list[int]:
        """The candidates of an effect on a place: one for each shape that it is tried in."""
        return [k for k, c in enumerate(self.candidates) if (c.effect, c.where) == (effect, where)]


def basis_of(plant: Plant, rollouts: Sequence[Rollout], findings: Findings | None, thresholds: Thresholds) -> Basis:
    """The basis by the sizes of the signals in `rollouts`, which are matched with `plant`."""
    every = all_candidates(plant, rollouts, (), thresholds.candidates)
    rule = thresholds.plan.information
    chosen: list[Candidate] = []
    sizes: list[np.ndarray] = []
    found: dict[int, Finding] = {}
    unasked = []
    for finding in findings.listed if findings else ():
        own = _nearest(every, finding)
        if own is None:
            unasked.append(finding.name)
            continue
        found[len(chosen)] = finding
        candidate, size = _at(own, finding)
        chosen.append(candidate)
        sizes.append(size)
    names = {(c.effect, c.where) for c in chosen}
    asked = [o for f in found.values() for o in f.equivalent]
    rivals = [c for c in every if (c.effect, c.where) in asked and (c.effect, c.where) not in names]
    names |= {(c.effect, c.where) for c in rivals}
    others = []
    for c in every:
        if c.effect in rule.usual and (c.effect, c.where) not in names:
            names.add((c.effect, c.where))
            others.append(c)
    chosen += [*rivals, *others]
    sizes += [np.ones(len(c.free)) for c in (*rivals, *others)]
    usual = tuple(k for k, c in enumerate(chosen) if c.effect in rule.fitted)
    return Basis(tuple(chosen), tuple(sizes), found, usual, tuple(unasked))


def _values(finding: Finding) -> np.ndarray:
    """Its parameters as a fit moves them."""
    values = np.array(finding.found.values(), dtype=float)
    if finding.found.effect in INVERSE:
        values[0] = 1.0 / values[0]
    return values


def _nearest(every: Sequence[Candidate], finding: Finding) -> Candidate | None:
    """The candidate on its place whose shape is nearest."""
    values = _values(finding)
    same = [c for c in every if (c.effect, c.where) == (finding.found.effect, finding.where)]

    def apart(c: Candidate) -> float:
        shape = [i for i in range(len(values)) if i not in c.free]
        return float(np.abs(c.start[shape] - values[shape]).sum())

    return min(same, key=apart, default=None)


def _at(c: Candidate, finding: Finding) -> tuple[Candidate, np.ndarray]:
    """The candidate with the found change as its step, and the size (F,) in such steps: 1, or 0 for no change."""
    change = _values(finding) - np.array(c.nominal)
    steps = np.where(np.abs(change) > 1e-6 * np.abs(c.step), change, c.step)
    size = np.array([float(steps[i] == change[i]) for i in c.free])
    return replace(c, step=tuple(float(s) for s in steps)), size
