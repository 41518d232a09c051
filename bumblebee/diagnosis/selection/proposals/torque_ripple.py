"""Torque ripple of any number of periods a turn, looked for over the measured angle.

A motor's cogging behind a gear has the motor's own periods times the gear's ratio in a turn of the joint: tens to
hundreds, and no whole number. A wave that is off by half a period over the joint's travel explains nothing, so the few
numbers that all candidates are screened at miss it, and what is left then passes for friction. On joints that lack
torque, waves of all numbers are asked how much they explain, closely enough that one keeps step over the whole travel:
a periodogram in the angle, by the answers to impulses, which costs no simulation.

The angle is the encoder's, carried on smoothly between its readings, for a simulation without the ripple has left it
by a period before a window ends. A log slower than the ripple is no obstacle: a wave is averaged over the parts of a
window, as the joint's inertia does, and an alias in one window is out of step in others, whose speeds are different.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.stats import chi2

from bumblebee.diagnosis.candidates import Candidate, is_chosen
from bumblebee.diagnosis.estimation import LeftOver
from bumblebee.diagnosis.residuals import Problem
from bumblebee.diagnosis.selection.changes import Asking, Vain
from bumblebee.diagnosis.selection.moves import Terms, refitted
from bumblebee.diagnosis.selection.score_tests import Scores, score_tests
from bumblebee.diagnosis.selection.screening import restless
from bumblebee.diagnosis.selection.state import SearchState
from bumblebee.diagnosis.selection.trial import Trial, try_one
from bumblebee.diagnosis.sensitivities import Columns
from bumblebee.diagnosis.simulation import joint_path
from bumblebee.diagnosis.thresholds.proposals import TorqueRipple

KIND = "cogging"


def ripple_trials(run: SearchState, tried: Sequence[Trial] = ()) -> Asking[list[Trial]]:
    """The ripple that explains most on each of the joints that lack most torque; none where none is beyond chance.

    Each joint is asked once, and again when something was found on it. What is faint beside what was `tried` waits.
    """
    rule = run.problem.thresholds.selection.proposals.torque_ripple
    open_ = {c.where: c for c in run.candidates if c.effect == KIND and not is_chosen(c, run.fit.chosen)}
    open_ = {where: c for where, c in open_.items() if (KIND, where) not in run.hopeless}
    if not open_ or run.answers is None:
        return []
    left, joints = run.small_fit().clean(run.small), len(run.problem.plant.joints)
    poor = [where for where in restless(run.small, run.answers.white, left, joints) if where in open_]
    best_so_far = run.fit.cost - min((t.cost for t in tried), default=run.fit.cost)
    faint = run.rule.faint * best_so_far * len(run.keep) / len(run.problem.windows)
    found = []
    for like in (open_[where] for where in poor[: rule.joints]):
        peaks = promising(run, like)
        clear = [(candidate, steps) for candidate, steps, gain in peaks if gain >= faint]
        if peaks and not clear:
            continue
        yield Vain(KIND, like.where)
        trials = [_tried(run, candidate, steps) for candidate, steps in clear]
        best = min((t for t in trials if t is not None), key=lambda t: t.cost, default=None)
        if best is not None and best.cost < run.fit.cost - run.bound**2 / 2:
            found.append(best)
    return found


def promising(run: SearchState, like: Candidate) -> list[tuple[Candidate, np.ndarray, float]]:
    """The highest peaks of a joint's periodogram that noise does not make, steps (2,) and gains that they suggest.

    Args:
        run: the search, whose screening windows are asked.
        like: a candidate of cogging on the joint.
    """
    rule = run.problem.thresholds.selection.proposals.torque_ripple
    every = _waves(run.small, like, rule)
    tests = [_tests(run, some, rule) for some in _parts(every, rule.together)]
    gain = np.concatenate([np.empty(0), *(t.gain for t in tests)])
    steps = [step for t in tests for step in t.steps]
    count, power = len(every) + len(run.candidates), max(run.fit.power(run.problem), 1.0)
    least = power * chi2.isf(run.config.level / count, len(like.free))
    around = np.concatenate(([-np.inf], gain, [-np.inf]))
    peaks = np.flatnonzero((gain >= around[:-2]) & (gain >= around[2:]) & (gain > least))
    return [(every[k], steps[k], float(gain[k])) for k in peaks[np.argsort(-gain[peaks])][: rule.tried]]


def _tried(run: SearchState, candidate: Candidate, steps: np.ndarray) -> Trial | None:
    """A wave at its size, refitted until it is in step: half a step of the series is much to a linear fit."""
    rule = run.problem.thresholds.selection.proposals.torque_ripple
    trial = None if candidate in run.closed else try_one(run.problem, run.fit, candidate, steps, run.weights)
    if trial is None:
        return None
    start = np.concatenate((run.fit.values, trial.values))
    terms = Terms(0.0, (), rule.iterations, weighed_after=True, held=True)
    move = refitted(run.now, run.fit, candidate, [start], terms)
    if move is None:
        return trial
    values, beside = move.after.of(candidate), LeftOver(run.problem, run.fit, run.weights)
    (after,) = run.problem.residual([[*run.fit.effects, candidate.at(values)]])
    return Trial(candidate, values, beside.cost(after), beside.left(run.fit.residual - after))


def _waves(problem: Problem, like: Candidate, rule: TorqueRipple) -> list[Candidate]:
    """Candidates of all numbers of periods from half a wave over the travel to what the encoder still resolves."""
    column = problem.plant.joints.index(like.where)
    travel = max(float(np.ptp(r.joint_pos[:, column])) for r in problem.windows.source)
    most = min(rule.most, rule.phase / float(problem.sigma[column]))
    numbers = np.arange(np.pi / travel, most, rule.dense * 2 * np.pi / travel)
    return [replace(like, step=(*like.step[:2], float(n))) for n in numbers]


def _tests(run: SearchState, some: Sequence[Candidate], rule: TorqueRipple) -> Scores:
    """Score tests of some waves on one joint, on the screening windows."""
    problem, answers = run.small, run.answers
    column = problem.plant.joints.index(some[0].where)
    white = answers.white[:, problem.plant.dof[column]] if answers else np.empty((len(problem.windows), 0, 0))
    angle = _angles(problem, column, white.shape[1] * rule.angles)
    phase = np.array([c.step[2] for c in some])[:, None, None] * angle
    waves = np.stack([some[0].step[0] * np.sin(phase), some[0].step[1] * np.cos(phase)], axis=1)
    torque = waves.reshape(2 * len(some), len(angle), white.shape[1], -1).mean(axis=3)
    values = np.matmul(torque.transpose(1, 0, 2).astype(np.float32), white).transpose(1, 0, 2)
    return score_tests(problem, Columns(some, values), run.small_fit(), run.weights[run.keep])


def _angles(problem: Problem, column: int, count: int) -> np.ndarray:
    """Angles (W, count) [rad] of a joint in the middles of as many parts of each window, by its encoder."""
    windows, since = problem.windows, (np.arange(count) + 0.5) * problem.windows.span / count
    out = np.empty((len(windows), count))
    for i in np.unique(windows.rollout):
        rollout, mine = windows.source[i], windows.rollout == i
        path = CubicSpline(rollout.time, joint_path(rollout, column, problem.plant.thresholds.path))
        out[mine] = path(rollout.time[windows.start[mine]][:, None] + since)
    return out


def _parts(every: Sequence[Candidate], size: int) -> Iterator[Sequence[Candidate]]:
    return (every[k : k + size] for k in range(0, len(every), size))
