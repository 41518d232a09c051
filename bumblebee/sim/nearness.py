"""Geometries that touch from a distance on."""

import copy

import mujoco


def touching_from(model: mujoco.MjModel, distance: float) -> mujoco.MjModel:
    """A copy of the model in which geometries make a contact where they are nearer than a distance [m].

    It overrides every margin that is declared. `geom_margin` would not do: MuJoCo 4 adds up those of two geometries,
    and one that is set after compiling finds nothing more on bodies of several geometries.
    """
    near = copy.copy(model)
    near.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_OVERRIDE)
    near.opt.o_margin = distance
    return near
