"""Material of a diagnosis: windows to fit, windows to accept by, candidates."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bumblebee.diagnosis.candidates import Candidate, all_candidates, scales_of, still_joints
from bumblebee.diagnosis.comparison import Holdout
from bumblebee.diagnosis.config import DiagnosisConfig
from bumblebee.diagnosis.dataset import Session, informative
from bumblebee.diagnosis.residuals import Problem, make_problem
from bumblebee.diagnosis.simulation import choose_starts, cut, plant_by, vary
from bumblebee.diagnosis.thresholds import Thresholds
from bumblebee.errors import BadInput
from bumblebee.sim.effects import Effect


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
        models = varied.models if varied.plant is None else ()
        rules = self.problem.thresholds.candidates
        typical = scales_of(plant, rollouts, rules.scales, models).torque
        return all_candidates(plant, rollouts, self.still, rules, models), typical


def gather(session: Session, config: DiagnosisConfig, rng: np.random.Generator, say: Callable[[str], None]) -> Material:
    """Cut the windows and whiten them by simulation; `BadInput` where no stretch is long enough."""
    session, rules = _by(session, config.thresholds), config.thresholds.candidates
    still = still_joints(session.plant, session.rollouts, session.sigma, rules.still)
    candidates = all_candidates(session.plant, session.rollouts, still, rules)
    session = informative(session, config.horizon)
    fitted = [i for i in session.train if i not in session.accept]
    say(
        f"{len(fitted)} rollouts to fit, {len(session.accept)} to accept by, {len(session.holdout)} held out, "
        f"{len(candidates)} candidates"
    )
    # A small model costs little to simulate: more windows.
    extent = session.thresholds.extent
    more = (
        float(np.clip(session.thresholds.time_steps.small_model / session.plant.model.nv, 1.0, extent.more))
        if config.grow
        else 1.0
    )
    say("propagating the initial-state noise")
    problem = _problem(session, fitted, round(more * config.max_windows), config, rng)
    holdout = _holdout(session, fitted, config, more, rng)
    say(f"{len(problem.windows)} windows of {config.horizon:g} s")
    typical = scales_of(session.plant, session.rollouts, rules.scales).torque
    return Material(session, still, candidates, typical, problem, holdout)


def _by(session: Session, thresholds: Thresholds) -> Session:
    """The session used and simulated by other thresholds; what was decided when it was made stands."""
    plant = plant_by(session.plant, thresholds.simulation)
    return replace(session, plant=plant, thresholds=thresholds.dataset)


def _holdout(
    session: Session, fitted: Sequence[int], config: DiagnosisConfig, more: float, rng: np.random.Generator
) -> Holdout:
    """Windows of 0.2 s of the rollouts that acceptance is decided on; of 1 s of these and of the `fitted` ones.

    What goes wrong within the second of one fitted window in a hundred is no less wrong for having been fitted until
    0.2 s.
    """
    if not session.accept:
        return Holdout()
    problem = _problem(session, session.accept, round(more * config.max_holdout_windows), config, rng)
    length, rule = session.thresholds.extent.long_window, session.plant.thresholds.windows
    some, many = (
        [s for ids in (session.accept, fitted) for s in choose_starts(session.rollouts, ids, length, count, rule)]
        for count in (config.max_long_windows, _last_windows(session, config))
    )
    if not some:
        return Holdout(problem)
    long = cut(session.plant, session.layout, session.rollouts, some, outputs=1)
    last = long if many == some else cut(session.plant, session.layout, session.rollouts, many, outputs=1)
    return Holdout(problem, long, last)


def _last_windows(session: Session, config: DiagnosisConfig) -> int:
    """How many windows of 1 s judge the last fit, of fitted and other rollouts each: more where they cost little."""
    extent = session.thresholds.extent
    if not config.grow or session.plant.model.nv > session.thresholds.time_steps.small_model:
        return config.max_long_windows
    work = session.plant.model.nv * extent.long_window / session.steps[0]
    return round(float(np.clip(extent.last_work / work, 1.0, extent.more_last)) * config.max_long_windows)


def _problem(
    session: Session, ids: Sequence[int], budget: int, config: DiagnosisConfig, rng: np.random.Generator
) -> Problem:
    horizon = config.horizon
    starts = choose_starts(session.rollouts, ids, horizon, budget, session.plant.thresholds.windows)
    if not starts:
        names = ", ".join(session.ids(ids)[:3])
        raise BadInput(f"rollouts {names}", f"stretches of {horizon:g} s", "shorter ones", "Record longer runs.")
    windows = cut(session.plant, session.layout, session.rollouts, starts)
    finest, coarse = session.steps
    steps = (session.search_step, coarse)
    plant, layout, thresholds = session.plant, session.layout, config.thresholds
    return make_problem(plant, layout, windows, session.sigma, steps, [], rng, finest, thresholds)
