"""Which point of a robot stands for which landmark of a person: a small YAML file beside the robot's MJCF."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from bumblebee.errors import BadInput
from bumblebee.io.read import parse_yaml, read_text
from bumblebee.motion.retarget.tree import Tree, tree_of
from bumblebee.robot.facts import joints, stand_pose
from bumblebee.robot.model import RobotConfig, build_model

SIDES = ("left", "right")
LIMBS = ("hip", "knee", "ankle", "shoulder", "elbow", "wrist")
POINTS = (*(f"{side}_{limb}" for side in SIDES for limb in LIMBS), "neck")
"""Landmarks that a mapping places on the robot, in the order of `Robot.body`."""
CORNERS = 4
_KEYS = ("robot", "points", "soles", "sole_radius", "joint_speed", "rest")
_JOINT_SPEED = 20.0  # rad/s, where a mapping states none: what the slower of the G1's motors reach


@dataclass(frozen=True, eq=False)
class Robot:
    """A robot that motions are retargeted to.

    `body` (13,) and `local` (13, 3) [m]: where `POINTS` lie; `sole_body` (8,) and `sole` (8, 3) [m]: the corners of
    both soles, left foot first, each heel left, heel right, toe left, toe right; `fastest` (n,) [rad/s]; `rest` (n,)
    [rad]: the angles that joints keep where the person says nothing about them.
    """

    name: str
    model: mujoco.MjModel
    tree: Tree
    body: np.ndarray
    local: np.ndarray
    sole_body: np.ndarray
    sole: np.ndarray
    radius: float
    """Of the spheres at the soles' corners [m]."""
    fastest: np.ndarray
    rest: np.ndarray


@cache
def g1() -> Robot:
    """The G1 with its wrists locked, as all of BumbleBee has it."""
    model = build_model(RobotConfig(feet="capsules"))
    text = files("bumblebee.motion.retarget").joinpath("robots/g1.yaml").read_text()
    speeds = np.array([joint.velocity_limit for joint in joints()])
    return make_robot("g1.yaml", parse_yaml("g1.yaml", text), model, speeds, stand_pose())


def read_robot(model: Path, mapping: Path) -> Robot:
    """Any humanoid, from its MJCF and its mapping.

    Raises:
        BadInput: a model that MuJoCo does not load, a mapping that names what the model does not have.
    """
    try:
        loaded = mujoco.MjModel.from_xml_path(str(model))
    except ValueError as error:
        raise BadInput(model, "an MJCF that MuJoCo loads", " ".join(str(error).split())[:200]) from None
    return make_robot(mapping, parse_yaml(mapping, read_text(mapping)), loaded)


def make_robot(
    where: object,
    mapping: Any,
    model: mujoco.MjModel,
    fastest: np.ndarray | None = None,
    rest: np.ndarray | None = None,
) -> Robot:
    """A robot from a mapping that has been read, and its model."""
    if not isinstance(mapping, Mapping) or set(mapping) - set(_KEYS) or {"points", "soles"} - set(mapping):
        came = ", ".join(map(str, mapping))[:80] if isinstance(mapping, Mapping) else f"a {type(mapping).__name__}"
        raise BadInput(where, f"a mapping with {', '.join(_KEYS)}", came)
    tree = tree_of(model, where)
    placed = _table(f"{where}: points", mapping["points"], POINTS)
    points = [_point(f"{where}: points.{name}", placed[name], tree) for name in POINTS]
    soles = _table(f"{where}: soles", mapping["soles"], SIDES)
    corners = [corner for side in SIDES for corner in _sole(f"{where}: soles.{side}", soles[side], tree)]
    if fastest is None:
        fastest = _by_joint(f"{where}: joint_speed", mapping.get("joint_speed", {}), tree, _JOINT_SPEED)
    if rest is None:
        middle = np.clip(0.0, tree.low, tree.high)
        rest = _by_joint(f"{where}: rest", mapping.get("rest", {}), tree, middle)
    return Robot(
        str(mapping.get("robot", model.names[: model.names.index(b"\0")].decode() or "robot")),
        model,
        tree,
        np.array([body for body, _ in points]),
        np.array([local for _, local in points]),
        np.array([body for body, _ in corners]),
        np.array([local for _, local in corners]),
        _radius(f"{where}: sole_radius", mapping.get("sole_radius", 0.0)),
        fastest,
        rest,
    )


def _table(where: str, value: Any, names: tuple[str, ...]) -> Mapping[str, Any]:
    missing = [name for name in names if not isinstance(value, Mapping) or name not in value]
    unknown = [str(name) for name in value if name not in names] if isinstance(value, Mapping) else []
    if missing or unknown:
        raise BadInput(where, ", ".join(names), f"none for {missing[0]}" if missing else f"unknown {unknown[0][:40]!r}")
    return value


def _point(where: str, value: Any, tree: Tree) -> tuple[int, np.ndarray]:
    """Body and place of `name` or `[name, [x, y, z]]`."""
    name, local = value if isinstance(value, list) and len(value) == 2 else (value, [0.0, 0.0, 0.0])
    if name not in tree.bodies:
        raise BadInput(where, "a body of the model", repr(name)[:60], f"Bodies: {', '.join(tree.bodies)}"[:300])
    return tree.bodies.index(name), _vector(where, local)


def _sole(where: str, value: Any, tree: Tree) -> list[tuple[int, np.ndarray]]:
    if not isinstance(value, list) or len(value) != 2 or not isinstance(value[1], list) or len(value[1]) != CORNERS:
        wanted = "[body, [heel left, heel right, toe left, toe right]], each corner [x, y, z]"
        raise BadInput(where, wanted, repr(value)[:80])
    return [_point(where, [value[0], corner], tree) for corner in value[1]]


def _radius(where: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value < 0.5:
        raise BadInput(where, "a radius from 0 to 0.5 m", repr(value)[:40])
    return float(value)


def _vector(where: str, value: Any) -> np.ndarray:
    numbers = isinstance(value, list) and all(isinstance(x, int | float) and not isinstance(x, bool) for x in value)
    if not numbers or len(value) != 3 or not np.isfinite(value).all():
        raise BadInput(where, "three numbers [m]", repr(value)[:60])
    return np.array(value, float)


def _by_joint(where: str, value: Any, tree: Tree, default: float | np.ndarray) -> np.ndarray:
    """One number a joint: a number for all, or a table whose names may leave out left_ and right_ and _joint."""
    result = np.broadcast_to(np.asarray(default, float), (len(tree.joints),)).copy()
    table = value if isinstance(value, Mapping) else dict.fromkeys(tree.joints, value)
    for name, number in table.items():
        if isinstance(number, bool) or not isinstance(number, int | float) or not np.isfinite(number):
            raise BadInput(f"{where}.{name}", "a number", repr(number)[:40])
        hit = [j for j, joint in enumerate(tree.joints) if name in (joint, _plain(joint))]
        if not hit:
            raise BadInput(where, f"joints of the model: {', '.join(tree.joints)}"[:300], repr(name)[:60])
        result[hit] = number
    return result


def _plain(joint: str) -> str:
    return joint.removesuffix("_joint").removeprefix("left_").removeprefix("right_")
