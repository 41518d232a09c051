"""Random pushes of the robots: velocities that are added to their roots."""

import math

import torch
from torch import Tensor

from bumblebee.sim.engine import Engine
from bumblebee.tracking.config import Randomisation


class Pushes:
    """Clock of each world, and who was pushed last; the tensors stay where they are.

    Args:
        config: how often and how hard.
        n: worlds.
        dt: control period [s].
        device: where the robots are.
    """

    def __init__(self, config: Randomisation, n: int, dt: float, device: torch.device) -> None:
        self._config, self._dt = config, dt
        self.clock = push_phase(config, n, dt, device)
        """(n,) control steps, those by which it began ahead with them."""
        self.pushed = torch.zeros(n, dtype=torch.bool, device=device)
        """(n,) bool: pushed at the end of the last step."""

    def apply(self, engine: Engine, generator: torch.Generator) -> None:
        """Apply this step's random pushes."""
        config = self._config
        self.clock += 1
        if config.push and config.push_regular:
            push: Tensor | None = regular_push(config, self.clock, self._dt, generator)
        else:
            push = draw_push(config, len(self.clock), self._dt, generator)
        self.pushed.zero_()
        if push is not None:
            engine.push(push)
            self.pushed.copy_(push.any(-1))


def push_phase(config: Randomisation, n: int, dt: float, device: torch.device) -> Tensor:
    """Control steps (n,) by which the worlds' clocks of regular pushes are ahead, spread over the interval."""
    return torch.arange(n, device=device) * _every(config, dt) // n


def regular_push(config: Randomisation, clock: Tensor, dt: float, generator: torch.Generator) -> Tensor:
    """Velocities (n, 3) [m/s] to add to the roots: `push`, its heading drawn, where a clock (n,) ends an interval."""
    due = (clock % _every(config, dt) == 0) & (clock > 0)
    heading = 2 * math.pi * torch.rand(len(clock), generator=generator, device=clock.device)
    speed = config.push * due
    return torch.stack((speed * heading.cos(), speed * heading.sin(), torch.zeros_like(heading)), dim=-1)


def _every(config: Randomisation, dt: float) -> int:
    """Control steps between regular pushes."""
    return max(round(config.push_interval / dt), 1)


def draw_push(config: Randomisation, n: int, dt: float, generator: torch.Generator) -> Tensor | None:
    """Velocities (n, 3) [m/s] to add to the roots in this control step, mostly zero, on the generator's device.

    None if nobody is ever pushed, or, on a CPU, where a look costs nothing, nobody now.
    """
    if not config.push:
        return None
    device = generator.device
    pushed = torch.rand(n, generator=generator, device=device) < dt / config.push_interval
    if device.type == "cpu" and not bool(pushed.any()):
        return None
    heading = 2 * math.pi * torch.rand(n, generator=generator, device=device)
    speed = config.push * torch.rand(n, generator=generator, device=device) * pushed
    return torch.stack((speed * heading.cos(), speed * heading.sin(), torch.zeros_like(speed)), dim=-1)
