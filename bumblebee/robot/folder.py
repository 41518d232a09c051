"""A robot's folder, read: a robot.yaml (docs/your-robot.md says what stands in it) and the maker's MJCF as published.

All that depends on the robot is read from here; a process has one robot (`which`) from its first import to its end.
"""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.io.read import parse_yaml, read_text
from bumblebee.robot.shapes import Bodies, capsule
from bumblebee.robot.which import SHIPPED, chosen_name, path_of, shipped
from bumblebee.robot.written import EVERY, SIDES, Written, require


@dataclass(frozen=True, eq=False)
class RobotFolder:
    """A robot as its folder says it.

    `bodies`: name -> parent, pose, inertia, joint, collision primitives, sites, parents first; lengths m, masses kg,
    inertias kg m^2, angles rad, torques N m, quaternions wxyz.
    """

    written: Written
    bodies: Bodies
    sha256: str
    """Hash of what a policy depends on: bodies, joints, motors, key bodies, soles and stand. Its contract names it."""


@cache
def chosen() -> RobotFolder:
    """The robot of this process."""
    return read_folder(path_of(chosen_name()))


def read_folder(path: Path) -> RobotFolder:
    """A robot from its file.

    Raises:
        BadInput: a key, a body or a joint that is not there, or a model that no robot of ours can be (`bodies_of`).
    """
    text = read_text(path)
    written = require(path, _said(path, text))
    source = (SHIPPED if written.bodies else path.parent) / (written.bodies or written.model)
    table = _table(source) if written.bodies else _of_model(source)
    _require_known(path, table, written)
    bodies = _with_soles(_with_points(_with_motors(path, table, written), written), written)
    return RobotFolder(written, bodies, _hash(bodies, written))


def _hash(bodies: Bodies, written: Written) -> str:
    what = [
        bodies,
        written.held,
        dict(written.key_bodies),
        dict(written.soles),
        written.sole_radius,
        dict(written.stand),
    ]
    return hashlib.sha256(json.dumps(what, sort_keys=True).encode()).hexdigest()


def _said(path: Path, text: str) -> Any:
    """The file's content; what it does not say is as in the file that it is `like`, of those that come along."""
    said = parse_yaml(path, text)
    like = said.pop("like", None) if isinstance(said, dict) else None
    if like is None:
        return said
    if like not in shipped():
        raise BadInput(f"{path}: like", f"one of {', '.join(shipped())}", repr(like)[:60])
    other = SHIPPED / f"{like}.yaml"
    return {**_said(other, read_text(other)), **said}


def _of_model(path: Path) -> Bodies:
    from bumblebee.robot.mjcf import bodies_of  # with MuJoCo, which a table does not need

    return bodies_of(path)


def _table(path: Path) -> Bodies:
    table = parse_yaml(path, read_text(path))
    if not isinstance(table, Mapping) or not isinstance(table.get("bodies"), dict):
        raise BadInput(path, "a table `bodies`", "none")
    return table["bodies"]


def _require_known(path: Path, bodies: Bodies, written: Written) -> None:
    """Refuse bodies and joints that the model does not have, and a pelvis that is not what floats."""
    joints = [facts["joint"]["name"] for facts in bodies.values() if "joint" in facts]
    named = {
        "held": written.held,
        "motors": [name for name in written.motors if name != EVERY],
        "layouts": [joint for left_out in written.layouts.values() for joint in left_out],
        "stand": [key for key in written.stand if not any(key in stand_names(joint) for joint in joints)],
    }
    for key, names in named.items():
        for name in names:
            if name not in joints:
                raise BadInput(f"{path}: {key}", f"joints of the model: {', '.join(joints)}"[:400], name[:60])
    placed = {"head": written.head, "neck": written.neck}
    for key, (body, _) in {**placed, **{f"key_bodies.{r}": point for r, point in written.key_bodies.items()}}.items():
        if body not in bodies:
            raise BadInput(f"{path}: {key}", f"a body of the model: {', '.join(bodies)}"[:400], body[:60])
    for role, (body, place) in written.key_bodies.items():
        if place is not None and role in bodies:
            raise BadInput(f"{path}: key_bodies.{role}", f"the model's own body {role}", f"a point of {body}")
    root, pelvis = next(iter(bodies)), written.key_bodies["pelvis"][0]
    if pelvis != root:
        raise BadInput(f"{path}: key_bodies.pelvis", f"{root}, the body that floats", pelvis)
    whole = [body for body, place in written.key_bodies.values() if place is None]
    if twice := [body for body in whole if whole.count(body) > 1]:
        do = f"Write one of them as a point of it: [{twice[0]}, [0.0, 0.0, 0.1]]."
        raise BadInput(f"{path}: key_bodies", "14 places, each named once", f"{twice[0]} twice", do)


def stand_names(joint: str) -> tuple[str, ...]:
    """Keys of `stand` that mean a joint, the first that is said: its name, less `_joint`, less its side."""
    stem = joint.removesuffix("_joint")
    return joint, stem, stem.split("_", 1)[-1]


def _with_motors(path: Path, bodies: Bodies, written: Written) -> Bodies:
    """The table with what `motors` says of its joints in the place of the model's."""
    joints = {facts["joint"]["name"]: facts["joint"] for facts in bodies.values() if "joint" in facts}
    for name, joint in joints.items():
        joint |= {**written.motors.get(EVERY, {}), **written.motors.get(name, {})}
    for name, joint in joints.items():
        lacks = [key for key in ("effort_limit", "velocity_limit", "armature") if key not in joint]
        if lacks:
            do = f"Write `motors: {{{name}: {{{lacks[0]}: ...}}}}` in {path.name}."
            raise BadInput(f"{path}: {name}", f"its {lacks[0]}", "neither in the model nor in `motors`", do)
        if ("kp" in joint) != ("kd" in joint):
            raise BadInput(f"{path}: {name}", "kp and kd of a servo, or neither", "one of them")
    return bodies


def _with_points(bodies: Bodies, written: Written) -> Bodies:
    """The table with a body without mass at each key body that is a point of another, such as a hand of a forearm."""
    for role, (body, place) in written.key_bodies.items():
        if place is not None:
            bodies[role] = {
                "parent": body,
                "pos": list(place),
                "quat": [1.0, 0.0, 0.0, 0.0],
                "mass": 0.0,
                "com": [0.0, 0.0, 0.0],
                "inertia": [0.0, 0.0, 0.0],
                "inertia_quat": [1.0, 0.0, 0.0, 0.0],
            }
    return bodies


def _with_soles(bodies: Bodies, written: Written) -> Bodies:
    """The table with two capsules along each sole's edges as a foot's shapes; one that has its own soles keeps them."""
    for side in SIDES:
        foot = bodies[written.key_bodies[f"{side}_foot"][0]]
        if not any(shape["name"] == f"{side}_foot1_collision" for shape in foot.get("collision", [])):
            corners = [np.array(corner) for corner in sorted(written.soles[side], key=lambda one: (one[1], one[0]))]
            edges = enumerate((corners[:2], corners[2:]), 1)
            foot["collision"] = [capsule(f"{side}_foot{i}_collision", a, b, written.sole_radius) for i, (a, b) in edges]
    return bodies
