"""Flat and rough ground (paper, table of domain randomisation: "Terrain type: flat, rough").

One height field for all worlds: its half x < 0 is flat at height 0, its half x > 0 rough, with heights drawn uniformly
at knots a cell apart and the surface straight between them. An episode starts at a place drawn on one half or the
other.
Motions know only flat ground, so each robot is seen in its clip's frame: the place's offset is taken off, and the mean
height of the ground around the robot with it. References are thereby lifted by that height.
"""

from dataclasses import replace

import mujoco
import numpy as np
import torch
from torch import Tensor

from bumblebee.sim.engine import RobotState
from bumblebee.sim.sensors import FLOOR
from bumblebee.tracking.config import Terrain
from bumblebee.tracking.rows import Rows

FIELD = "terrain"
_DEPTH = 0.5  # m of ground below the lowest point
_SPOTS = 0.4  # of the half size: how far from the middle episodes start
_EDGE = 1.0  # m: nobody goes on closer to the edge than this
_AROUND, _NEAR = 1, 3  # cells to each side: for the mean height, and for the highest point under a robot


def heights(config: Terrain) -> np.ndarray:
    """Heights (N, N) [m] of the knots, rows along y, columns along x, from -size to size."""
    count = 2 * round(config.half_side / config.cell) + 1
    rough = np.random.default_rng(config.seed).uniform(-config.amplitude, config.amplitude, (count, count))
    rough[:, : count // 2 + 1] = 0.0
    return rough


def add_terrain(spec: mujoco.MjSpec, config: Terrain) -> None:
    """Put the height field in place of the floor's plane, under the same name; nothing where no ground is rough."""
    if not config.rough:
        return
    grid = heights(config)
    low, high = float(grid.min()), float(grid.max())
    size = [config.half_side, config.half_side, high - low, _DEPTH]
    scaled = ((grid - low) / (high - low)).ravel()
    spec.add_hfield(name=FIELD, size=size, nrow=len(grid), ncol=len(grid), userdata=scaled)
    floor = spec.geom(FLOOR)
    floor.type = mujoco.mjtGeom.mjGEOM_HFIELD
    floor.hfieldname = FIELD
    floor.size = [0.0, 0.0, 0.0]
    floor.pos = [0.0, 0.0, low]


class Ground:
    """Where on the terrain each of B robots plays its clip.

    Args:
        config: see `Terrain`; some of it is rough.
        worlds: B.
        device: where the tensors are.
    """

    def __init__(self, config: Terrain, worlds: int, device: torch.device | str) -> None:
        self.config = config
        grid = torch.as_tensor(heights(config), dtype=torch.float32)[None, None]
        self._mean = _around(grid, _AROUND, torch.nn.functional.avg_pool2d).to(device)
        self._top = _around(grid, _NEAR, torch.nn.functional.max_pool2d).to(device)
        self.origin = torch.zeros(worlds, 2, device=device)
        """(B, 2) [m]: where the clip's world origin lies on the terrain."""

    def lift(self, place_w: Tensor) -> Tensor:
        """Mean height (n,) [m] of the ground around places (n, 2) [m] of the terrain."""
        return self._at(self._mean, place_w)

    def place(self, rows: Rows, qpos: Tensor, generator: torch.Generator) -> Tensor:
        """Draw where the robots of `rows` start and return qpos (n, 7 + J) there, no sole in the ground.

        A share `rough` of them starts on the rough half, the others on the flat one.
        """
        draws = torch.rand(len(qpos), 3, generator=generator, device=qpos.device)
        spread = _SPOTS * self.config.half_side
        x = torch.where(draws[:, 0] < self.config.rough, draws[:, 1], -draws[:, 1]) * spread
        spot = torch.stack((x, (2 * draws[:, 2] - 1) * spread), dim=-1)
        rows.put(self.origin, spot - qpos[:, :2])
        moved = qpos.clone()
        moved[:, :2] = spot
        moved[:, 2] += self._at(self._top, spot)
        return moved

    def in_clip_frame(self, state: RobotState) -> RobotState:
        """The robots as if each stood on flat ground in its clip's own world."""
        place = state.root_pos_w[:, :2]
        shift = torch.cat((self.origin, self.lift(place)[:, None]), dim=-1)
        read = state.read_key_pos_w
        return replace(
            state,
            root_pos_w=state.root_pos_w - shift,
            key_pos_w=state.key_pos_w - shift[:, None],
            read_key_pos_w=None if read is None else read - shift[:, None],
        )

    def beyond(self, state: RobotState) -> Tensor:
        """Robots (B,) bool, seen in their clips' frames, that come too close to the terrain's edge."""
        place = state.root_pos_w[:, :2] + self.origin
        return place.abs().amax(-1) > self.config.half_side - _EDGE

    def _at(self, grid: Tensor, place_w: Tensor) -> Tensor:
        """Bilinear value (n,) of a grid at places (n, 2)."""
        last = len(grid) - 1
        # A world that blew up is nowhere; it still has to be looked up.
        where = ((place_w + self.config.half_side) / self.config.cell).nan_to_num(0.0).clamp(0, last)
        low = where.floor().long().clamp(max=last - 1)
        part = where - low
        x, y = low[:, 0], low[:, 1]
        near = torch.lerp(grid[y, x], grid[y, x + 1], part[:, 0])
        far = torch.lerp(grid[y + 1, x], grid[y + 1, x + 1], part[:, 0])
        return torch.lerp(near, far, part[:, 1])


def _around(grid: Tensor, cells: int, pool: object) -> Tensor:
    """Mean or maximum (N, N) of a grid (1, 1, N, N) over so many cells to each side; the edge goes on outside."""
    padded = torch.nn.functional.pad(grid, (cells,) * 4, mode="replicate")
    return pool(padded, kernel_size=2 * cells + 1, stride=1)[0, 0]  # type: ignore[operator]
