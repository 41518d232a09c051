"""Worlds that differ: ground friction, servo gains, motor strength, link masses, dry friction, and pushes."""

import math

import numpy as np
import torch
from torch import Tensor

from bumblebee.sim.mujoco_cpu import MujocoCpu
from bumblebee.tracking.config import Randomisation


def randomise_worlds(engine: MujocoCpu, config: Randomisation, seed: int) -> None:
    """Draw each world's parameters once, around those of its model (corrected or declared)."""
    random = np.random.default_rng(seed)
    batch, n, model = engine.batch, engine.num_worlds, engine.model
    if config.friction != (1.0, 1.0):
        friction = batch.expand("geom_friction")
        friction[:, :, 0] *= random.uniform(*config.friction, size=(n, 1))
    if config.gains or config.strength:
        strength = 1 - random.uniform(0, config.strength, size=(n, model.nu))
        gain, bias = batch.expand("actuator_gainprm"), batch.expand("actuator_biasprm")
        stiffness = strength * random.uniform(1 - config.gains, 1 + config.gains, size=(n, model.nu))
        damping = strength * random.uniform(1 - config.gains, 1 + config.gains, size=(n, model.nu))
        gain[:, :, 0] *= stiffness
        bias[:, :, :2] *= stiffness[:, :, None]  # the offset of a shifted encoder scales with the gain
        bias[:, :, 2] *= damping
        if config.strength:
            batch.expand("actuator_forcerange")[:] *= strength[:, :, None]
    if config.frictionloss:
        batch.expand("dof_frictionloss")[:, 6:] += random.uniform(0, config.frictionloss, size=(n, model.nv - 6))
    if config.mass:
        factor = random.uniform(1 - config.mass, 1 + config.mass, size=(n, model.nbody))
        batch.expand("body_mass")[:] *= factor
        batch.expand("body_inertia")[:] *= factor[:, :, None]
        batch.set_const()


def draw_push(config: Randomisation, n: int, dt: float, generator: torch.Generator) -> Tensor | None:
    """Velocities (n, 3) [m/s] to add to the roots in this control step, mostly zero; None if nobody is pushed."""
    if not config.push:
        return None
    pushed = torch.rand(n, generator=generator) < dt / config.push_interval
    if not bool(pushed.any()):
        return None
    heading = 2 * math.pi * torch.rand(n, generator=generator)
    speed = config.push * torch.rand(n, generator=generator) * pushed
    return torch.stack((speed * heading.cos(), speed * heading.sin(), torch.zeros(n)), dim=-1)
