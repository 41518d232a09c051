"""What a diagnosis works on: windows to fit, windows to accept by, candidates."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from bumblebee.diagnosis.candidates import Candidate, all_candidates, scales_of, still_joints
from bumblebee.diagnosis.comparison import Holdout
from bumblebee.diagnosis.config import DiagnosisConfig
from bumblebee.diagnosis.dataset import Session, informative
from bumblebee.diagnosis.residuals import Problem, make_problem
from bumblebee.diagnosis.simulation import choose_starts, cut, vary
from bumblebee.errors import BadInput
from bumblebee.sim.effects import Effect

_LONG = 1.0  # [s]
_MORE = 2.5  # times as many windows for the smallest models


@dataclass(frozen=True, eq=False)
class Material:
    """The declared model's windows and candidates."""

    session: Session
    """With the parts of its rollouts as they are used."""
    still: list[str]
    """Joints that never move."""
    candidates: list[Candidate]
    typical: np.ndarray
    """(J,) RMS torques of the joints [N m]."""
    problem: Problem
    holdout: Holdout

    def remade(self, effects: Sequence[Effect]) -> tuple[list[Candidate], np.ndarray]:
        """Candidates with steps for a model with some effects, and its joints' typical torques (J,) [N m]."""
        plant, rollouts = self.session.plant, self.session.rollouts
        varied = vary(plant, effects)
        model = varied.model if varied.plant is None else None
        return all_candidates(plant, rollouts, self.still, model), scales_of(plant, rollouts, model).torque


def gather(session: Session, config: DiagnosisConfig, rng: np.random.Generator, say: Callable[[str], None]) -> Material:
    """Cut the windows and whiten them by simulation; `BadInput` where no stretch is long enough."""
    still = still_joints(session.plant, session.rollouts, session.sigma)
    candidates = all_candidates(session.plant, session.rollouts, still)
    session = informative(session, config.horizon)
    fitted = [i for i in session.train if i not in session.accept]
    say(
        f"{len(fitted)} rollouts to fit, {len(session.accept)} to accept by, {len(session.holdout)} held out, "
        f"{len(candidates)} candidates"
    )
    # A small model costs little to simulate: more windows.
    more = float(np.clip(12 / session.plant.model.nv, 1.0, _MORE)) if config.grow else 1.0
    say("what noise in the starts becomes, by simulation")
    problem = _problem(session, fitted, round(more * config.max_windows), config, rng)
    holdout = _holdout(session, config, more, rng)
    say(f"{len(problem.windows)} windows of {config.horizon:g} s")
    typical = scales_of(session.plant, session.rollouts).torque
    return Material(session, still, candidates, typical, problem, holdout)


def _holdout(session: Session, config: DiagnosisConfig, more: float, rng: np.random.Generator) -> Holdout:
    """Windows of 0.2 s and of 1 s of the rollouts that acceptance is decided on."""
    if not session.accept:
        return Holdout()
    problem = _problem(session, session.accept, round(more * config.max_holdout_windows), config, rng)
    starts = choose_starts(session.rollouts, session.accept, _LONG, config.max_long_windows)
    long = cut(session.plant, session.layout, session.rollouts, starts, outputs=1) if starts else None
    return Holdout(problem, long)


def _problem(
    session: Session, ids: Sequence[int], budget: int, config: DiagnosisConfig, rng: np.random.Generator
) -> Problem:
    horizon = config.horizon
    starts = choose_starts(session.rollouts, ids, horizon, budget)
    if not starts:
        names = ", ".join(session.ids(ids)[:3])
        raise BadInput(f"rollouts {names}", f"stretches of {horizon:g} s", "shorter ones", "Record longer runs.")
    windows = cut(session.plant, session.layout, session.rollouts, starts)
    finest, coarse = session.steps
    steps = (session.search_step, coarse)
    plant, layout, thresholds = session.plant, session.layout, config.thresholds
    return make_problem(plant, layout, windows, session.sigma, steps, [], rng, finest, thresholds)
