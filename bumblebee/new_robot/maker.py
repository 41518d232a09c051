"""Shapes and pose that a maker's MJCF tells beside the table: how far each link reaches, and how the robot is kept."""

from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

from bumblebee.robot.mjcf import base_of, compiled

CORNERS = np.array([(x, y, z) for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
"""(8, 3) of a box of half lengths 1."""
_STANDS = ("stand", "home")  # words in the name of a keyframe that a robot stands in


@dataclass(frozen=True, eq=False)
class Maker:
    """A model's shapes and pose."""

    boxes: dict[str, list[np.ndarray]]
    """Body -> corners (8, 3) [m] of the box around each of its shapes in its frame, meshes left out."""
    stand: dict[str, float]
    """Joint -> angle [rad] of the keyframe that is named after a stand; empty without one."""


def maker_of(path: Path) -> Maker:
    """Read a model that `mjcf.bodies_of` has taken."""
    model, _ = compiled(path)
    root = base_of(path, model)
    boxes: dict[str, list[np.ndarray]] = {}
    for geom in range(model.ngeom):
        body = int(model.geom_bodyid[geom])
        if model.body_rootid[body] == root:
            boxes.setdefault(model.body(body).name, []).append(_box(model, geom))
    named = [k for k in range(model.nkey) if any(word in model.key(k).name.lower() for word in _STANDS)]
    hinges = [j for j in range(model.njnt) if model.jnt_type[j] == mujoco.mjtJoint.mjJNT_HINGE]
    angles = model.key_qpos[named[0]] if named else np.zeros(0)
    return Maker(boxes, {model.joint(j).name: float(angles[model.jnt_qposadr[j]]) for j in hinges} if named else {})


def _box(model: mujoco.MjModel, geom: int) -> np.ndarray:
    """Corners (8, 3) [m] of the box around a shape, in its body's frame."""
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, model.geom_quat[geom])
    centre, half = model.geom_aabb[geom, :3], model.geom_aabb[geom, 3:]
    return (centre + half * CORNERS) @ turn.reshape(3, 3).T + model.geom_pos[geom]
