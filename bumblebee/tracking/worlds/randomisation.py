"""Worlds that differ (paper, appendix B, table of domain randomisation).

| row of the table | here |
|---|---|
| Friction, U(0.5, 1.25) | `friction`: a factor on the friction of all geometries, 1 on floor and soles |
| Base CoM offset, U(-0.1, 0.1) m | `base_com`: along each axis of the torso, as public code of the field has it |
| Link mass, U(0.8, 1.2) x default | `mass` 0.2: each body's mass and inertia by one factor |
| P gain, D gain, U(0.75, 1.25) x default | `gains` 0.25: each servo's P and D by factors of their own |
| Control delay, U(20, 40) ms | `delay`: one for all commands of a world, need not be a whole number of physics steps |
| Push robot, interval 10 s, v_xy 0.5 m/s | `push`, `push_interval`, `push_regular`: `tracking.worlds.pushes` |
| Terrain type, flat, rough | `tracking.worlds.terrain` |

Drawn once for each world. `strength` and `frictionloss` are ours.
"""

import mujoco
import numpy as np

from bumblebee.errors import BadInput
from bumblebee.robot.facts import TRUNK
from bumblebee.sim.engine import Engine
from bumblebee.tracking.config import Randomisation

BASE = TRUNK
"""The body whose centre of mass `base_com` shifts."""


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
    if config.base_com:
        shift = random.uniform(-config.base_com, config.base_com, size=(n, 3))
        expand("body_ipos")[:, model.body(BASE).id] += shift
    if any(config.delay):
        _check_buffers(model, config.delay[1])
        expand("actuator_delay")[:] += random.uniform(*config.delay, size=(n, 1))
    return fields


def _check_buffers(model: mujoco.MjModel, longest: float) -> None:
    """Refuse a model whose servos cannot delay their commands by `longest` [s] more."""
    room = (model.actuator_history[:, 0] - 1) * model.opt.timestep
    if (room < model.actuator_delay + longest).any():
        came, do = "a model without room for it", "Load it with tracking.model.task_model."
        raise BadInput("env.randomisation.delay", f"buffers for {1e3 * longest:g} ms", came, do)
