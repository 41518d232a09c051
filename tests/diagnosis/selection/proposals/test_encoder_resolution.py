"""Grids of readings: found where the joint crosses some steps, and not where there is none."""

from dataclasses import replace

import numpy as np
import pytest

from bumblebee.diagnosis.selection.proposals.encoder_resolution import grids
from bumblebee.measured.rollout import Rollout

NOISE = 1e-3


def _rollout(step: float, cells: float, seed: int = 0, frames: int = 1500) -> Rollout:
    """A joint that sways over about `cells` steps of 20 mrad, read on a grid of `step` [rad] (0: none) with noise."""
    rng, time = np.random.default_rng(seed), np.arange(frames) / 50
    sway = 0.5 * np.sin(1.3 * time + rng.uniform(0, 6)) + 0.5 * np.sin(2.9 * time + rng.uniform(0, 6))
    q = 0.5 * cells * 0.02 * sway
    q = np.round(q / step) * step if step else q
    read = (q + NOISE * rng.standard_normal(frames))[:, None]
    columns = {"joint_pos": read, "joint_vel": np.zeros_like(read), "joint_target": np.zeros_like(read)}
    return Rollout("r", ("hip",), 50.0, time, meta={}, **columns)


def test_a_joint_that_crosses_sixteen_steps_shows_them():
    (found,) = grids([_rollout(0.02, 18)], [NOISE])
    assert found.step == pytest.approx(0.02, rel=0.01)


@pytest.mark.parametrize("cells", [7, 9])
def test_of_a_grid_of_few_steps_no_overtone_is_taken_for_it(cells: float):
    for seed in range(4):
        assert [g.step for g in grids([_rollout(0.02, cells, seed)], [NOISE])] == [pytest.approx(0.02, rel=0.01)]


def test_a_smooth_motion_of_the_same_reach_shows_none():
    assert all(grids([_rollout(0.0, 18, seed)], [NOISE]) == [] for seed in range(20))


def test_the_error_of_a_step_is_that_of_the_readings_that_count():
    """Half of the log rests at one place, whose many readings weigh little: the step errs as its interval says."""
    step, away = 0.02, []
    for seed in range(40):
        rollout = _rollout(step, 25, seed)
        still = rollout.joint_pos.copy()
        place = np.round(np.random.default_rng(seed).uniform(-0.2, 0.2) / step) * step
        still[:750] = place + NOISE * np.random.default_rng(seed + 99).standard_normal((750, 1))
        (found,) = grids([replace(rollout, joint_pos=still)], [NOISE])
        away.append((found.step - step) / found.error)
    assert 0.7 < np.sqrt(np.mean(np.square(away))) < 1.3


def test_rest_at_two_places_is_no_grid():
    """Two places lie on a grid of any step that divides their distance; readings go to and fro within each."""
    creep = 5e-4 * np.sin(np.arange(170) / 50)
    for seed in range(40):
        rng = np.random.default_rng(seed)
        places = rng.uniform(-0.1, 0.1) + np.array([0.0, rng.uniform(0.04, 0.09)])
        read = [(p + creep + 1.5e-4 * rng.standard_normal(170))[:, None] for p in places]
        assert grids([replace(_rollout(0.0, 1, seed, 170), joint_pos=q) for q in read], [1.5e-4]) == []
