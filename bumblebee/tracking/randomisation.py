"""Worlds that differ: ground friction, servo gains, motor strength, link masses, dry friction, and pushes."""

import math

import mujoco
import numpy as np
import torch
from torch import Tensor

from bumblebee.sim.engine import Engine
from bumblebee.tracking.config import Randomisation


def randomise_worlds(engine: Engine, config: Randomisation, seed: int) -> None:
    """Draw each world's parameters once, around those of its model (corrected or declared)."""
    fields = draw_fields(engine.model, config, engine.num_worlds, seed)
    if fields:
        engine.set_fields(fields)


def draw_fields(model: mujoco.MjModel, config: Randomisation, n: int, seed: int) -> dict[str, np.ndarray]:
    """Fields of `model` that differ between n worlds, name -> (n, ...) as in `MjModel`; none for zero ranges."""
    random = np.random.default_rng(seed)
    fields: dict[str, np.ndarray] = {}

    def expand(name: str) -> np.ndarray:
        fields[name] = np.repeat(np.asarray(getattr(model, name))[None], n, axis=0)
        return fields[name]

    if config.friction != (1.0, 1.0):
        expand("geom_friction")[:, :, 0] *= random.uniform(*config.friction, size=(n, 1))
    if config.gains or config.strength:
        strength = 1 - random.uniform(0, config.strength, size=(n, model.nu))
        gain, bias = expand("actuator_gainprm"), expand("actuator_biasprm")
        stiffness = strength * random.uniform(1 - config.gains, 1 + config.gains, size=(n, model.nu))
        damping = strength * random.uniform(1 - config.gains, 1 + config.gains, size=(n, model.nu))
        gain[:, :, 0] *= stiffness
        bias[:, :, :2] *= stiffness[:, :, None]  # the offset of a shifted encoder scales with the gain
        bias[:, :, 2] *= damping
        if config.strength:
            expand("actuator_forcerange")[:] *= strength[:, :, None]
    if config.frictionloss:
        expand("dof_frictionloss")[:, 6:] += random.uniform(0, config.frictionloss, size=(n, model.nv - 6))
    if config.mass:
        factor = random.uniform(1 - config.mass, 1 + config.mass, size=(n, model.nbody))
        expand("body_mass")[:] *= factor
        expand("body_inertia")[:] *= factor[:, :, None]
    return fields


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
