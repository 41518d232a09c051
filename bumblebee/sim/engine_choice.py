"""The engines by name."""

from typing import Literal

import mujoco

from bumblebee.sim.effects import RuntimeHooks
from bumblebee.sim.effects.cpu_engine import EffectsCpu, needs_effects
from bumblebee.sim.engine import Engine
from bumblebee.sim.mujoco_cpu import MujocoCpu
from bumblebee.sim.warp_limits import Buffers

Name = Literal["mujoco", "mujoco_warp"]


def make_engine(
    name: Name,
    model: mujoco.MjModel,
    num_worlds: int,
    threads: int = 2,
    hooks: RuntimeHooks | None = None,
    buffers: Buffers | None = None,
    device: str = "cuda",
) -> Engine:
    """An engine with `num_worlds` copies of `model`: MuJoCo on `threads` CPU threads, or MuJoCo Warp on `device`.

    Raises:
        BadInput: for a model or a machine that the engine cannot use.
    """
    if name == "mujoco":
        on_cpu = EffectsCpu if needs_effects(model, hooks) else MujocoCpu
        return on_cpu(model, num_worlds, threads=threads, hooks=hooks)
    from bumblebee.sim.effects.warp_engine import EffectsWarp
    from bumblebee.sim.mujoco_warp import MujocoWarp

    on_gpu = EffectsWarp if needs_effects(model, hooks) else MujocoWarp
    return on_gpu(model, num_worlds, hooks=hooks, buffers=buffers, device=device)
