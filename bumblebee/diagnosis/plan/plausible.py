"""Which of the robots that a plan may meet explain the data nearly as well as the diagnosed one."""

from collections.abc import Sequence

import numpy as np

from bumblebee.diagnosis.dataset import Session
from bumblebee.diagnosis.plan.machine import Machine
from bumblebee.diagnosis.plan.unknowns import Case
from bumblebee.diagnosis.simulation import Windows, choose_starts, cut, residuals, vary
from bumblebee.diagnosis.thresholds.plan import Unknowns
from bumblebee.sim.effects import Effect


def implausible(
    machine: Machine, session: Session, cases: Sequence[Case], found: Sequence[Effect], horizon: float, rule: Unknowns
) -> list[str]:
    """Names of the cases that are not this robot: of some joint they miss a good part of the motion in the data.

    And by far more than the diagnosed robot does, which is never among them. The declared robot may be one of them; the
    end of an interval with all else as it was found, or a rival at the size at which it imitates to first order, where
    effects are large or hang together.

    Args:
        machine: the robot.
        session: the data.
        cases: robots that a plan may meet.
        found: effects (E,) of the diagnosed robot.
        horizon: length of the windows [s].
        rule: how many windows, and what is too far off.
    """
    rollouts = session.rollouts
    starts = choose_starts(rollouts, list(range(len(rollouts))), horizon, rule.windows)
    if not starts:
        return []
    windows = cut(session.plant, machine.seen_layout, rollouts, starts)
    least = _left(machine, session, windows, found)
    known = np.isfinite(least).all(axis=(1, 2))
    if not known.any():
        return []
    joints = machine.seen_layout.slices["joint_pos"]
    moved = windows.measured[known][..., joints] - windows.qpos[known][:, None, session.plant.qpos]
    most = np.maximum(rule.share * _size(moved), rule.worse * _size(least[known]))
    most = np.maximum(most, rule.worse * machine.sigma[joints])
    tried = [case for case in cases if case.effects != found]
    return [c.name for c in tried if not (_size(_left(machine, session, windows, c.effects)[known]) <= most).all()]


def _left(machine: Machine, session: Session, windows: Windows, effects: Sequence[Effect]) -> np.ndarray:
    """(W, N, J) measured - simulated positions [rad, m] in fine steps; NaN where the simulation diverged."""
    layout = machine.seen_layout
    left = residuals(session.plant, layout, windows, [vary(session.plant, effects)], machine.steps[0])[0]
    return left[..., layout.slices["joint_pos"]]


def _size(left: np.ndarray) -> np.ndarray:
    """(J,) root mean square of each joint."""
    return np.sqrt((left**2).mean(axis=(0, 1)))
