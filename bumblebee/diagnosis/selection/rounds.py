"""A round of the search: which proposals are asked for trials, in which order, and when."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from bumblebee.diagnosis.candidates import SATURATIONS, Candidate
from bumblebee.diagnosis.selection.changes import Asking
from bumblebee.diagnosis.selection.proposals.all_joints import start_far_off, start_with_all_joints
from bumblebee.diagnosis.selection.proposals.backlash import backlash_trials
from bumblebee.diagnosis.selection.proposals.drive_grid import drive_trials
from bumblebee.diagnosis.selection.proposals.joint_elasticity import joint_elasticity_trials
from bumblebee.diagnosis.selection.proposals.saturation import saturation_trials
from bumblebee.diagnosis.selection.proposals.setpoints import setpoint_trials
from bumblebee.diagnosis.selection.proposals.surface_contact import surface_trials
from bumblebee.diagnosis.selection.proposals.torque_ripple import ripple_trials
from bumblebee.diagnosis.selection.state import SearchState
from bumblebee.diagnosis.selection.steps import go
from bumblebee.diagnosis.selection.trial import Trial

ALL_JOINTS = "standard parameters of all joints"


@dataclass(eq=False)
class Round:
    """Trials that a round has come by so far."""

    run: SearchState
    last: bool = False
    """Whether the search ends if this round finds nothing."""
    tried: list[Trial] = field(default_factory=list)
    looked: list[Candidate] = field(default_factory=list)
    """Candidates that were looked at, with trials or without."""

    @property
    def explains_much(self) -> bool:
        """Whether one trial takes away much of the cost: then effects are found one after the other."""
        run = self.run
        least = min((t.cost for t in self.tried), default=np.inf)
        return bool(least <= (1 - run.rule.most_of_it) * run.fit.cost)

    @property
    def only_limits(self) -> bool:
        """Whether nothing else was tried: a limit alone does not say that slopes are none."""
        return all(t.candidate.effect in SATURATIONS for t in self.tried)

    @property
    def where_limits_matter(self) -> tuple[Candidate, ...]:
        """The candidates among which limits are tried: all, or while one trial explains much the places of these.

        What a limit does may pass for weakness or friction of its joint, and then the two are compared; a limit
        elsewhere is judged when the large effects are known.
        """
        if not self.explains_much:
            return tuple(self.run.candidates)
        places = {t.candidate.where for t in self.tried}
        return tuple(c for c in self.run.candidates if c.where in places)


@dataclass(frozen=True)
class Proposal:
    """A way to come by trials."""

    name: str
    """How it is called where it fails."""
    propose: Callable[[Round, SearchState], Asking[list[Trial] | None]]
    """Trials; None where it made the search begin anew, which ends the round."""
    when: Callable[[Round], bool] = lambda now: True
    """Whether it is asked, by what those before it have come by."""
    once: Callable[[Round], Any] | None = None
    """Its answer holds as long as this stays; None: it is asked in each round."""


def _drives(now: Round, run: SearchState) -> Asking[list[Trial]]:
    yield from ()
    return drive_trials(run.problem, run.fit, run.candidates, run.weights, run.config.far)


def _best(now: Round, run: SearchState) -> Asking[list[Trial]]:
    yield from ()
    tried, now.looked = run.trials()
    return tried


def _far_off(now: Round, run: SearchState) -> Asking[list[Trial] | None]:
    return None if (yield from start_far_off(run, now.tried)) else []


def _all_joints(now: Round, run: SearchState) -> Asking[list[Trial] | None]:
    return None if (yield from start_with_all_joints(run)) else []


def _contacts(now: Round, run: SearchState) -> Asking[list[Trial]]:
    yield from ()
    closed = tuple(run.closed)
    return surface_trials(run.problem, run.fit, run.candidates, run.weights, closed, run.holdout.problem)


def _late(now: Round, run: SearchState) -> Asking[list[Trial]]:
    return (yield from setpoint_trials(run, now.tried))


def _ripple(now: Round, run: SearchState) -> Asking[list[Trial]]:
    return (yield from ripple_trials(run, now.tried))


def _limits(now: Round, run: SearchState) -> Asking[list[Trial]]:
    some = now.where_limits_matter
    return (yield from saturation_trials(run.problem, run.fit, some, run.weights, run.hopeless, run.changes))


def _backlash(now: Round, run: SearchState) -> Asking[list[Trial]]:
    return (yield from backlash_trials(run))


def _elasticity(now: Round, run: SearchState) -> Asking[list[Trial]]:
    return (yield from joint_elasticity_trials(run))


SINGLE = (
    Proposal("drives far from the declared ones", _drives, when=lambda now: not now.run.given),
    Proposal("trials of the best candidates", _best, when=lambda now: now.only_limits),
)
"""Single effects, drives far from the declared ones first."""
PROPOSALS = (
    *SINGLE,
    Proposal("drives that follow their targets late", _late),
    Proposal(ALL_JOINTS, _far_off),
    Proposal(ALL_JOINTS, _all_joints, when=lambda now: not now.explains_much),
    Proposal("contact with a surface", _contacts, once=lambda now: now.run.fit),
    Proposal("torque ripple", _ripple),
    Proposal("limits of drives", _limits, once=lambda now: (now.run.fit, now.where_limits_matter)),
    Proposal("backlash", _backlash, when=lambda now: not now.tried),
    Proposal("joint elasticity", _elasticity, when=lambda now: not now.tried or now.last),
)
"""Those of a round, in the order in which they are asked."""
Kept = dict[str, tuple[Any, list[Trial] | None]]
"""Answers of proposals, and what must stay for them to hold."""


def ask(now: Round, proposals: Sequence[Proposal], kept: Kept) -> bool:
    """Ask proposals for trials; whether the search began anew instead."""
    run = now.run
    for row in proposals:
        if not row.when(now):
            continue
        key = row.once(now) if row.once else None
        if row.once is None or row.name not in kept or kept[row.name][0] != key:
            step = partial(go, run, partial(row.propose, now))
            kept[row.name] = key, run.problem.plant.failures.attempt(row.name, step, list)
        found = kept[row.name][1]
        if found is None:
            return True
        now.tried += [t for t in found if t.candidate not in run.closed]
    return False
