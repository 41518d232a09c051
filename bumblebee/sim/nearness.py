"""Geometries that can touch, and from what distance on."""

import copy

import mujoco
import numpy as np


def touching_from(model: mujoco.MjModel, distance: float) -> mujoco.MjModel:
    """A copy of the model in which geometries make a contact where they are nearer than a distance [m].

    It overrides every margin that is declared. `geom_margin` would not do: MuJoCo 4 adds up those of two geometries,
    and one that is set after compiling finds nothing more on bodies of several geometries.
    """
    near = copy.copy(model)
    near.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_OVERRIDE)
    near.opt.o_margin = distance
    return near


def colliding(model: mujoco.MjModel) -> np.ndarray:
    """(ngeom,) bool: geometries that can touch some other, by their masks or by a pair that the model names."""
    named = np.isin(np.arange(model.ngeom), (model.pair_geom1, model.pair_geom2))
    return (model.geom_contype | model.geom_conaffinity != 0) | named
