"""State that an episode's steps so far leave for the rewards of feet and of moving bodies."""

from dataclasses import dataclass

import torch
from torch import Tensor

from bumblebee.robot.facts import FEET, KEY_BODIES

FOOT_KEYS = tuple(KEY_BODIES.index(foot) for foot in FEET)
_CONTACT = 1.0  # N, as in legged_gym


@dataclass(frozen=True)
class Now:
    """Additions of one step to the state.

    `key_vel_w` (B, K, 3) [m/s] of the key bodies by differences; of the feet (B, 2): `contact` bool (now, unfiltered),
    `landed` bool (down after a flight), `air_time` [s] and `height` [m, the highest] of the flight that goes on or has
    just ended.
    """

    key_vel_w: Tensor
    contact: Tensor
    landed: Tensor
    air_time: Tensor
    height: Tensor


class Memory:
    """Buffers that stay where they are, one row a world.

    A foot counts as down if the floor pushes it up with more than 1 N in this step or the one before, as in legged_gym.

    Args:
        worlds: B.
        dt: control period [s].
        device: where the states are.
    """

    def __init__(self, worlds: int, dt: float, device: torch.device | str) -> None:
        self.dt = dt
        self.key_pos = torch.zeros(worlds, len(KEY_BODIES), 3, device=device)
        self.air_time = torch.zeros(worlds, 2, device=device)
        self.height = torch.zeros(worlds, 2, device=device)
        self.touched = torch.zeros(worlds, 2, dtype=torch.bool, device=device)

    def update(self, key_pos_w: Tensor, foot_force_w: Tensor, fresh: Tensor) -> Now:
        """Take in a step.

        Args:
            key_pos_w: (B, K, 3) [m].
            foot_force_w: (B, 2, 3) [N].
            fresh: (B,) bool, worlds whose episode has its first step: nothing before it is theirs.
        """
        contact = foot_force_w[..., 2] > _CONTACT
        old = ~fresh[:, None]
        key_pos_w = torch.nan_to_num(key_pos_w)  # a world that blew up is put anew, what is kept of it must be numbers
        speed = torch.where(old[..., None], (key_pos_w - self.key_pos) / self.dt, torch.zeros_like(key_pos_w))
        down = contact | (self.touched & old)
        landed = (self.air_time * old > 0) & down
        air_time = self.air_time * old + self.dt
        height = torch.maximum(self.height * old, torch.stack([key_pos_w[:, i, 2] for i in FOOT_KEYS], dim=-1))
        self.key_pos.copy_(key_pos_w)
        self.air_time.copy_(air_time * ~down)
        self.height.copy_(height * ~down)
        self.touched.copy_(contact)
        return Now(speed, contact, landed, air_time, height)

    def kept(self) -> dict[str, Tensor]:
        """The buffers, for a checkpoint."""
        return {name: getattr(self, name) for name in ("key_pos", "air_time", "height", "touched")}
