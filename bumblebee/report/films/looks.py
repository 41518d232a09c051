"""The G1 as one sees it: shells and motors put over the model that is simulated, for drawing alone.

What is added has no mass and touches nothing, so that physics stays what it was.
"""

import os
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import yaml

from bumblebee.errors import BadInput

MESHES = "BUMBLEBEE_G1_MESHES"
"""Environment variable that names the folder of Unitree's mesh files."""
VISUAL, HIDDEN = 2, 4
"""Groups of the geoms that are drawn, and of those that collide."""
_POINTS = 20  # of a ring
# Unitree's mesh files that are no link's own: (link, place of the mesh in the link's frame of `robot/g1.yaml`, colour).
_MORE = {
    "pelvis_contour_link": ("pelvis", (0, 0, 0), "shell"),
    "waist_support_link": ("torso_link", (0.0039635, 0, -0.044), "shell"),
    "logo_link": ("torso_link", (0.0039635, 0, -0.044), "dark"),
    "head_link": ("torso_link", (0.0039635, 0, -0.044), "dark"),
    "left_rubber_hand": ("left_wrist_yaw_link", (0.0415, 0.003, 0), "dark"),
    "right_rubber_hand": ("right_wrist_yaw_link", (0.0415, -0.003, 0), "dark"),
}
_DARK_LINKS = ("pelvis", "hip_pitch_link", "ankle_roll_link")


def meshes_of_user(folder: Path | None = None) -> Path | None:
    """The folder of Unitree's meshes that the user has; None where none was named.

    Args:
        folder: named on the command line; without, the environment variable `BUMBLEBEE_G1_MESHES`.

    Raises:
        BadInput: a folder that holds no `pelvis.STL`.
    """
    named = os.environ.get(MESHES, "")
    chosen = folder or (Path(named) if named else None)
    if chosen is not None and not (chosen / "pelvis.STL").is_file():
        remedy = "Name the folder `meshes` of Unitree's G1 description, or none: primitives are drawn then."
        raise BadInput("--meshes" if folder else MESHES, "a folder with pelvis.STL", str(chosen), remedy)
    return chosen


def is_g1(spec: mujoco.MjSpec) -> bool:
    """Whether a spec has the G1's links."""
    names = {body.name for body in spec.bodies}
    return names >= set(_table()["shapes"])


def dress(spec: mujoco.MjSpec, meshes: Path | None = None, tint: tuple[float, ...] | None = None) -> None:
    """Add the G1's visible shape to a spec and hide what collides; the floor stays.

    Args:
        spec: the G1's model, as `build_spec` makes it, or one made from it.
        meshes: folder of Unitree's STL files; without, the shape is made of primitives.
        tint: RGBA of every part, for a robot that is to be told from another; None for its own colours.
    """
    for geom in spec.geoms:
        if geom.type != mujoco.mjtGeom.mjGEOM_PLANE:
            geom.group, geom.rgba = HIDDEN, [*geom.rgba[:3], 0.0]
    for site in spec.sites:
        site.group = HIDDEN
    if meshes is None:
        _add_lofts(spec, tint)
    else:
        _add_meshes(spec, meshes, tint)


def _add_lofts(spec: mujoco.MjSpec, tint: tuple[float, ...] | None) -> None:
    colours, shapes = _table()["colours"], _table()["shapes"]
    for body in spec.bodies:
        right = body.name.startswith("right_")
        for number, shape in enumerate(shapes.get(body.name.replace("right_", "left_"), ())):
            points, faces = loft(shape["along"], shape["rings"], shape.get("square", 2.0))
            if right:
                points, faces = points * [1, -1, 1], faces[:, ::-1]
            mesh = spec.add_mesh(name=f"{body.name}_look{number}")
            mesh.uservert, mesh.userface = points.ravel().tolist(), faces.ravel().tolist()
            _add(body, mesh.name, (0, 0, 0), tint or (*colours[shape["colour"]], 1.0))


def _add_meshes(spec: mujoco.MjSpec, folder: Path, tint: tuple[float, ...] | None) -> None:
    colours = _table()["colours"]
    own = {b.name: (b.name, (0, 0, 0), "dark" if b.name.endswith(_DARK_LINKS) else "shell") for b in spec.bodies}
    for name, (link, place, colour) in {**own, **_MORE}.items():
        file = folder / f"{name}.STL"
        body = spec.body(link)
        if file.is_file() and body is not None:
            spec.add_mesh(name=f"{name}_look", file=str(file.resolve()))
            _add(body, f"{name}_look", place, tint or (*colours[colour], 1.0))


def _add(body: Any, mesh: str, place: tuple[float, ...], rgba: tuple[float, ...]) -> None:
    kind = mujoco.mjtGeom.mjGEOM_MESH
    body.add_geom(
        type=kind, meshname=mesh, pos=place, rgba=rgba, group=VISUAL, contype=0, conaffinity=0, mass=0, density=0
    )


def loft(along: str, rings: list[list[float]], square: float = 2.0) -> tuple[np.ndarray, np.ndarray]:
    """A closed surface through rings.

    Args:
        along: "x", "y" or "z", the axis that the rings stand on.
        rings: at least two of [place, centre, centre, half width, half width] [m], the places rising.
        square: exponent of the rings; 2 is an ellipse, larger is more of a box.

    Returns:
        Points (P, 3) [m] and triangles (F, 3), which look outwards.
    """
    axis = "xyz".index(along)
    first, second = (i for i in range(3) if i != axis)
    angle = np.arange(_POINTS) * 2 * np.pi / _POINTS
    circle = np.stack([np.cos(angle), np.sin(angle)])
    circle = np.sign(circle) * np.abs(circle) ** (2.0 / square)
    table = np.asarray(rings, dtype=np.float64)
    points = np.empty((len(table), _POINTS, 3))
    points[:, :, axis] = table[:, :1]
    points[:, :, first] = table[:, 1:2] + table[:, 3:4] * circle[0]
    points[:, :, second] = table[:, 2:3] + table[:, 4:5] * circle[1]
    ends = points[[0, -1]].mean(axis=1)
    here, after = np.arange(_POINTS), (np.arange(_POINTS) + 1) % _POINTS
    faces = []
    for ring in range(len(table) - 1):
        low, high = ring * _POINTS, (ring + 1) * _POINTS
        faces += [np.stack([low + here, low + after, high + after], 1)]
        faces += [np.stack([low + here, high + after, high + here], 1)]
    bottom, top, last = len(table) * _POINTS, len(table) * _POINTS + 1, (len(table) - 1) * _POINTS
    faces += [np.stack([np.full(_POINTS, bottom), after, here], 1)]
    faces += [np.stack([np.full(_POINTS, top), last + here, last + after], 1)]
    every = np.concatenate(faces)
    # Around y the other two axes are taken as (x, z), which turns the other way.
    return np.concatenate([points.reshape(-1, 3), ends]), every[:, ::-1] if along == "y" else every


@cache
def _table() -> dict[str, Any]:
    return yaml.safe_load(files(__package__).joinpath("looks.yaml").read_text())
