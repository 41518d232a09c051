"""Rough ground: its shape, how it is looked up, where robots start on it, and that they stand on it."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest
import torch

from bumblebee.sim.mujoco_cpu import MujocoCpu
from bumblebee.tracking.config import EnvConfig, Randomisation, Terrain
from bumblebee.tracking.env import TrackingEnv
from bumblebee.tracking.model import task_model
from bumblebee.tracking.sampling.library import MotionLibrary
from bumblebee.tracking.worlds.terrain import Ground, heights
from tests.tracking.clips import waving

ROUGH = Terrain(rough=1.0, half_side=6.0)
OFF = Randomisation(friction=(1.0, 1.0), gains=0.0, mass=0.0, push=0.0)
CONFIG = EnvConfig(num_worlds=6, threads=1, terrain=ROUGH, randomisation=OFF, reset_noise=0.0, start_share=1.0)


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    return task_model(CONFIG)


def make(model: mujoco.MjModel, config: EnvConfig = CONFIG, **clip: float) -> TrackingEnv:
    library = MotionLibrary([waving("a", 90, size=0.0, **clip)], config.ahead)
    return TrackingEnv(library, MujocoCpu(model, config.num_worlds, threads=1), config, 0)


def test_half_is_flat_and_half_is_rough() -> None:
    """The flat half is at height 0, the rough one within its amplitude on both sides."""
    grid = heights(ROUGH)
    middle = len(grid) // 2
    assert (grid[:, : middle + 1] == 0).all()
    rough = grid[:, middle + 1 :]
    assert rough.min() == pytest.approx(-ROUGH.amplitude, rel=0.01)
    assert rough.max() == pytest.approx(ROUGH.amplitude, rel=0.01)
    assert np.array_equal(grid, heights(ROUGH))


def test_the_simulated_ground_has_these_heights(model: mujoco.MjModel) -> None:
    """A ray straight down meets the ground where the grid says, at knots and in the middle between two."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    grid, middle = heights(ROUGH), round(ROUGH.half_side / ROUGH.cell)
    geom = np.zeros(1, dtype=np.int32)

    def height(x: float, y: float) -> float:
        start = np.array([x, y, 1.0])
        return 1.0 - mujoco.mj_ray(model, data, start, np.array([0.0, 0.0, -1.0]), None, 1, -1, geom)

    for column, row in ((5, 2), (11, -7), (-4, 9)):
        expected = grid[middle + row, middle + column]
        x, y = column * ROUGH.cell, row * ROUGH.cell
        # A hair beside the knot: a ray through a corner belongs to no triangle.
        assert height(x + 1e-4, y + 2e-4) == pytest.approx(expected, abs=1e-4)
        between = (expected + grid[middle + row, middle + column + 1]) / 2
        assert height(x + ROUGH.cell / 2, y + 1e-4) == pytest.approx(between, abs=1e-3)


def test_the_lift_is_the_mean_height_around_a_place() -> None:
    """At a knot the mean of it and its eight neighbours; between two knots the mean of theirs; 0 on flat ground."""
    grid, ground = heights(ROUGH), Ground(ROUGH, 1, "cpu")
    middle = round(ROUGH.half_side / ROUGH.cell)
    column, row = middle + 8, middle - 3

    def mean(c: int) -> float:
        return float(grid[row - 1 : row + 2, c - 1 : c + 2].mean())

    at = torch.tensor([[8.0, -3.0], [8.5, -3.0], [-8.0, 2.0]]) * ROUGH.cell
    expected = torch.tensor([mean(column), (mean(column) + mean(column + 1)) / 2, 0.0])
    torch.testing.assert_close(ground.lift(at), expected, atol=1e-6, rtol=0)
    assert torch.isfinite(ground.lift(torch.tensor([[float("nan"), 1e9]]))).all()


def test_robots_stand_on_it_and_are_seen_as_on_flat_ground(model: mujoco.MjModel) -> None:
    """No sole starts in the ground; feet come to carry the weight; the offset of place and height is taken off."""
    env = make(model)
    soles = [
        g for g in range(model.ngeom) if model.geom(g).name.endswith("collision") and "_foot" in model.geom(g).name
    ]
    lowest = env.engine.batch.bind("geom_xpos")
    env.engine.batch.forward(stage=int(mujoco.mjtStage.mjSTAGE_POS))
    lowest = lowest[:, soles]
    for world in range(6):
        for x, y, z in lowest[world]:
            assert z - 0.01 > _height(x, y) - 1e-3
    for _ in range(20):
        _, _, done, _ = env.step(torch.zeros(6, 23))
        assert not done.any()
    weight = float(model.body_mass.sum() * 9.81)
    force = env.engine.foot_force_w()[..., 2].sum(1)
    assert ((force > 0.5 * weight) & (force < 1.5 * weight)).all()
    apart = (env._state.root_pos_w - env._ref.root_pos_w).norm(dim=-1)
    assert apart.max() < 0.1  # m; nothing balances the robots
    spread = env.engine.state().root_pos_w[:, :2].std(0)
    assert (spread > 0.5).all()  # each plays elsewhere


def _height(x: float, y: float) -> float:
    """Height of the surface: the lower of the two ways to cut a cell into triangles."""
    grid, n = heights(ROUGH), round(ROUGH.half_side / ROUGH.cell)
    column, row = x / ROUGH.cell + n, y / ROUGH.cell + n
    c, r = int(column), int(row)
    u, v = column - c, row - r
    a, b, d, e = grid[r, c], grid[r, c + 1], grid[r + 1, c], grid[r + 1, c + 1]
    one = a + u * (b - a) + v * (d - a) if u + v < 1 else e + (1 - u) * (d - e) + (1 - v) * (b - e)
    other = a + u * (b - a) + v * (e - b) if u > v else a + v * (d - a) + u * (e - d)
    return min(one, other)


def test_the_share_of_rough_starts_is_kept(model: mujoco.MjModel) -> None:
    """A quarter of 4,000 starts is rough where that is asked for, and none lies near the edge."""
    from bumblebee.tracking.rows import Rows

    ground = Ground(replace(ROUGH, rough=0.25), 4000, "cpu")
    every = Rows(torch.ones(4000, dtype=torch.bool), by_mask=True)
    qpos = ground.place(every, torch.zeros(4000, 30), torch.Generator().manual_seed(0))
    assert float((qpos[:, 0] > 0).float().mean()) == pytest.approx(0.25, abs=0.03)
    assert qpos[:, :2].abs().max() <= 0.4 * ROUGH.half_side
    assert torch.equal(ground.origin, qpos[:, :2])


def test_a_walk_to_the_edge_ends_without_failure(model: mujoco.MjModel) -> None:
    """A robot put near the edge is taken out as by a time-out."""
    env = make(model)
    env.engine.batch.qpos[3, 0] = ROUGH.half_side - 0.5
    env.ground.origin[3, 0] += ROUGH.half_side - 0.5 - env._state.root_pos_w[3, 0] - env.ground.origin[3, 0]
    _, _, done, extras = env.step(torch.zeros(6, 23))
    assert done.tolist() == [world == 3 for world in range(6)]
    assert torch.equal(extras["time_outs"].bool(), done)
