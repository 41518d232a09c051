"""One model that holds several robots side by side or through each other, for drawing alone."""

from collections.abc import Callable, Sequence
from pathlib import Path

import mujoco

from bumblebee.report.films.plain_looks import show
from bumblebee.report.replays.replay import Drawn
from bumblebee.robot.model import build_spec

OTHERS = 1
"""Group of the geoms of all robots but the first."""


def drawing(
    robots: Sequence[Drawn], meshes: Path | None = None, make: Callable[[], mujoco.MjSpec] | None = None
) -> mujoco.MjModel:
    """A model whose state is the robots' states (F, nq) one after the other; nothing in it is simulated.

    Args:
        robots: at least one; the camera follows the first.
        meshes: folder of the G1's meshes, as `dress` takes it.
        make: spec of another robot than the declared G1; one that is no G1 is drawn by its own geoms.
    """
    parent: mujoco.MjSpec | None = None
    for robot in robots:
        spec = make() if make else build_spec()
        show(spec, meshes, robot.tint)
        _keep_bodies(spec, floor=parent is None)
        if parent is None:
            parent = spec
        else:
            _put_in_group(spec, OTHERS)
            parent.attach(spec, prefix=f"{robot.name}/", frame=parent.worldbody.add_frame())
    assert parent is not None
    return parent.compile()


def _put_in_group(spec: mujoco.MjSpec, group: int) -> None:
    for geom in spec.geoms:
        geom.group = group if geom.rgba[3] > 0 else geom.group


def _keep_bodies(spec: mujoco.MjSpec, floor: bool) -> None:
    """Leave out what moves, measures or lights, and the floor of all robots but the first."""
    for parts in (spec.keys, spec.actuators, spec.sensors, spec.lights, spec.cameras, spec.excludes):
        for part in list(parts):
            spec.delete(part)
    planes = [geom for geom in spec.geoms if geom.type == mujoco.mjtGeom.mjGEOM_PLANE]
    for plane in planes[1 if floor else 0 :]:
        spec.delete(plane)
