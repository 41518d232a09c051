"""The parts of effects that MJCF cannot carry and an engine adds at run time: what the sensors report."""

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from bumblebee.errors import BadInput
from bumblebee.sim.effect_catalogue import Effect


@dataclass(frozen=True, eq=False)
class RuntimeHooks:
    """What an engine does beside MuJoCo; columns are the model's hinge and slide joints in the model's order."""

    joints: tuple[str, ...]
    """Names of the J joints."""
    encoder_offset: np.ndarray
    """(J,) [rad]: added to every reading of the joint's position (the servo's part is native)."""

    @property
    def empty(self) -> bool:
        """Whether the model alone carries every effect."""
        return not self.encoder_offset.any()


def runtime_hooks(effects: Sequence[Effect], model: mujoco.MjModel) -> RuntimeHooks:
    """The hooks that `effects` need on `model`."""
    scalar = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))
    names = tuple(model.joint(j).name for j in range(model.njnt) if int(model.jnt_type[j]) in scalar)
    offset = np.zeros(len(names))
    for effect in effects:
        for place in effect.where if effect.effect == "encoder_offset" else ():
            if place not in names:
                raise BadInput(f"encoder_offset on joint {place!r}", "a hinge or slide of the model", "no such joint")
            offset[names.index(place)] = effect.value()
    return RuntimeHooks(names, offset)
