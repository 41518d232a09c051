"""A robot without a shape of its own as one sees it: what touches, bones from link to link, soles and a head.

What is added has no mass and touches nothing, so that physics stays what it was.
"""

from collections.abc import Sequence
from pathlib import Path

import mujoco
import numpy as np

from bumblebee.report.films.looks import VISUAL, dress, is_g1
from bumblebee.robot.facts import FEET, HEAD, SOLE_RADIUS, SOLES

_BONE, _SHORT = 0.025, 0.02  # m: radius, and the length below which a link needs none
_HEAD = 0.09  # m
_LIMB, _DARK = (0.95, 0.76, 0.2, 1.0), (0.25, 0.28, 0.33, 1.0)


def show(spec: mujoco.MjSpec, meshes: Path | None = None, tint: Sequence[float] | None = None) -> None:
    """Add what is to be seen of a robot to its spec.

    Args:
        spec: the G1, which gets its visible shape, or any other robot.
        meshes: folder of the G1's meshes, as `dress` takes it.
        tint: RGBA of every part, for a robot that is to be told from another; None for its own colours.
    """
    if is_g1(spec):
        dress(spec, meshes, tuple(tint) if tint else None)
        return
    if all(spec.body(name) is not None for name in (*FEET, HEAD[0])):  # the robot of this process
        _add_bones(spec)
        _add_soles(spec)
        _add(spec.body(HEAD[0]), mujoco.mjtGeom.mjGEOM_SPHERE, pos=HEAD[1], size=[_HEAD, 0, 0], rgba=_LIMB)
    if tint:
        for geom in spec.geoms:
            if geom.type != mujoco.mjtGeom.mjGEOM_PLANE:
                geom.rgba, geom.material = tint, ""


def _add_bones(spec: mujoco.MjSpec) -> None:
    """From each link to those that hang on it."""
    for body in spec.bodies:
        for child in body.bodies if body.name != "world" else ():
            if np.linalg.norm(child.pos) > _SHORT:
                ends = [0.0, 0.0, 0.0, *child.pos]
                _add(body, mujoco.mjtGeom.mjGEOM_CAPSULE, fromto=ends, size=[_BONE, 0, 0], rgba=_LIMB)


def _add_soles(spec: mujoco.MjSpec) -> None:
    """A plate around the corners of each sole."""
    for foot, corners in zip(FEET, SOLES, strict=True):
        low, high = np.min(corners, axis=0), np.max(corners, axis=0)
        half = (high - low) / 2 + SOLE_RADIUS
        _add(spec.body(foot), mujoco.mjtGeom.mjGEOM_BOX, pos=(low + high) / 2, size=half, rgba=_DARK)


def _add(body: mujoco.MjsBody, kind: mujoco.mjtGeom, **form: Sequence[float] | np.ndarray) -> None:
    body.add_geom(type=kind, group=VISUAL, contype=0, conaffinity=0, mass=0, density=0, **form)
