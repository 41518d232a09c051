"""A robot's body tree and its surfaces, as the page's 3D player reads them."""

import base64
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from bumblebee.report.films.plain_looks import show

_ROD = (0.55, 0.58, 0.62)
_SHOWN = 3  # groups of geoms that MuJoCo's viewer shows at first
_STEPS = 30_000  # of the largest coordinate; an int16 holds them
_MOST_BYTES = 1_000_000  # of the surfaces, before they are packed; beyond it they are made coarser


@dataclass(frozen=True)
class Surface:
    """Triangles of one body in one colour."""

    body: int
    points: np.ndarray
    """(P, 3) in the body's frame [m]."""
    faces: np.ndarray
    """(F, 3) indices of points."""
    rgb: tuple[float, ...]


@dataclass(frozen=True, eq=False)
class Shape:
    """A robot to be drawn."""

    model: mujoco.MjModel
    surfaces: list[Surface]
    data: dict[str, Any]
    """Tree and surfaces as JSON has them."""

    @property
    def free(self) -> bool:
        """Whether its first joint is a free one: its base moves about."""
        return bool(self.data["free"])


def shape(spec: mujoco.MjSpec, meshes: Path | None = None) -> Shape:
    """The tree and the surfaces of a robot.

    Args:
        spec: any MJCF; the G1 is drawn in its visible shape, any other robot by its own geoms. It stays as it is.
        meshes: folder of the G1's meshes, as `dress` takes it.
    """
    spec = spec.copy()
    show(spec, meshes)
    model = spec.compile()
    parts = coarse(surfaces(model))
    return Shape(model, parts, _data(model, parts))


def _data(model: mujoco.MjModel, parts: list[Surface]) -> dict[str, Any]:
    largest = max((float(np.abs(part.points).max()) for part in parts), default=1.0)
    points = [np.round(part.points * (_STEPS / largest)).astype("<i2") for part in parts]
    return {
        "bodies": [
            [int(model.body_parentid[b]), *_plain(model.body_pos[b]), *_plain(model.body_quat[b])]
            for b in range(model.nbody)
        ],
        "joints": [_joint(model, j) for j in range(model.njnt)],
        "nq": int(model.nq),
        "free": bool(model.njnt) and int(model.jnt_type[0]) == mujoco.mjtJoint.mjJNT_FREE,
        "floor": bool((model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE).any()),
        "pieces": [
            [part.body, len(part.points), len(part.faces), *_plain(part.rgb)] for part in parts
        ],
        "scale": largest / _STEPS,
        "points": packed(*points),
        "faces": packed(*(part.faces.astype("<u4") for part in parts)),
    }  # fmt: skip


def surfaces(model: mujoco.MjModel) -> list[Surface]:
    """Geoms as triangles: those of MuJoCo's visible groups, or all where none is in these; no floor, nothing unseen.

    A robot without geoms is drawn as rods from body to body with a ball at each centre of mass.
    """
    return _surfaces(model, _SHOWN) or _surfaces(model, mujoco.mjNGROUP) or list(_rods(model))


def _surfaces(model: mujoco.MjModel, groups: int) -> list[Surface]:
    found = []
    for geom in range(model.ngeom):
        colour = model.geom_rgba[geom] if model.geom_matid[geom] < 0 else model.mat_rgba[model.geom_matid[geom]]
        mesh = _triangles(model, geom)
        if mesh is None or model.geom_group[geom] >= groups or colour[3] == 0:
            continue
        turn = np.empty(9)
        mujoco.mju_quat2Mat(turn, model.geom_quat[geom])
        points = mesh[0] @ turn.reshape(3, 3).T + model.geom_pos[geom]
        found.append(Surface(int(model.geom_bodyid[geom]), points, mesh[1], tuple(colour[:3])))
    return found


def _rods(model: mujoco.MjModel) -> Iterator[Surface]:
    from trimesh import creation

    longest = float(np.linalg.norm(np.concatenate([model.body_pos, model.body_ipos]), axis=1).max()) or 1.0
    for body in range(1, model.nbody):
        ball = creation.icosphere(subdivisions=2, radius=0.12 * longest)
        yield Surface(body, ball.vertices + model.body_ipos[body], ball.faces, _ROD)
        if model.body_pos[body].any():
            rod = creation.cylinder(0.06 * longest, segment=[np.zeros(3), model.body_pos[body]], sections=16)
            yield Surface(int(model.body_parentid[body]), rod.vertices, rod.faces, _ROD)


def _triangles(model: mujoco.MjModel, geom: int) -> tuple[np.ndarray, np.ndarray] | None:
    """Points and faces in the geom's frame; None for planes, fields and what has no surface."""
    from trimesh import creation

    kind, size, types = int(model.geom_type[geom]), model.geom_size[geom], mujoco.mjtGeom
    if kind == types.mjGEOM_MESH:
        mesh = model.geom_dataid[geom]
        first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
        start, faces = model.mesh_faceadr[mesh], model.mesh_facenum[mesh]
        return model.mesh_vert[first : first + count].astype(float), model.mesh_face[start : start + faces]
    if kind == types.mjGEOM_BOX:
        made = creation.box(2 * size)
    elif kind in (types.mjGEOM_SPHERE, types.mjGEOM_ELLIPSOID):
        made = creation.icosphere(subdivisions=2)
        made.apply_scale(size if kind == types.mjGEOM_ELLIPSOID else size[0])
    elif kind == types.mjGEOM_CAPSULE:
        made = creation.capsule(2 * size[1], size[0], count=(16, 12))
        made.apply_translation([0, 0, -made.bounds.mean(axis=0)[2]])
    elif kind == types.mjGEOM_CYLINDER:
        made = creation.cylinder(size[0], 2 * size[1], sections=24)
    else:
        return None
    return np.asarray(made.vertices), np.asarray(made.faces)


def coarse(parts: list[Surface]) -> list[Surface]:
    """Parts whose points are merged on a grid, as fine as `_MOST_BYTES` allows."""
    grid = 0.0005
    while sum(6 * len(part.points) + 12 * len(part.faces) for part in parts) > _MOST_BYTES:
        parts = [_merged(part, grid) for part in parts]
        grid *= 1.5
    return parts


def _merged(part: Surface, grid: float) -> Surface:
    _, first, new = np.unique(np.round(part.points / grid), axis=0, return_index=True, return_inverse=True)
    faces = new.ravel()[part.faces]
    whole = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 0] != faces[:, 2])
    return Surface(part.body, part.points[first], faces[whole], part.rgb)


def packed(*arrays: np.ndarray) -> str:
    """Arrays one after the other, in base64."""
    return base64.b64encode(b"".join(np.ascontiguousarray(array).tobytes() for array in arrays)).decode()


def _joint(model: mujoco.MjModel, j: int) -> list[float]:
    at = int(model.jnt_qposadr[j])
    numbers = [*_plain(model.jnt_axis[j]), *_plain(model.jnt_pos[j]), *_plain(model.qpos0[at : at + 1])]
    return [int(model.jnt_bodyid[j]), int(model.jnt_type[j]), at, *numbers]


def _plain(values: Any) -> list[float]:
    return [round(float(value), 6) for value in values]
