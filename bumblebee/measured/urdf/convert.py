"""`from_urdf`: a URDF and the joints of a log as an MJCF that `diagnose` takes."""

import difflib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import mujoco

from bumblebee.errors import BadInput
from bumblebee.measured.urdf.mend import Stand, mend_inertias, mend_joints, weld
from bumblebee.measured.urdf.tree import MOVING, number, read_robot

DRIVES = ("position", "torque")


@dataclass(frozen=True)
class Drives:
    """Kind of every drive, and gains of those that follow position targets."""

    kind: str = "torque"
    """One of `DRIVES`: what the log has as commands."""
    kp: Mapping[str, float] = field(default_factory=dict)
    """Joint -> proportional gain [N m/rad, N/m]; "" for all others."""
    kv: Mapping[str, float] = field(default_factory=dict)
    """Joint -> derivative gain [N m s/rad, N s/m]; "" for all others."""


@dataclass(frozen=True)
class Made:
    """An MJCF and what was changed on the way to it."""

    xml: str
    notes: tuple[str, ...]


def from_urdf(path: Path, joints: Sequence[str], drives: Drives, stand: Stand | None = None) -> Made:
    """Make an MJCF of a URDF: `joints` move and have a drive each, all others are held still, meshes are left out.

    Raises:
        BadInput: no URDF, a joint that it lacks or that no log has a column for, gains that are not stated.
    """
    robot = read_robot(path)
    _require_joints(path, robot, joints)
    _require_gains(joints, drives)
    efforts = {str(one.get("name")): number(one.find("limit"), "effort") for one in robot.findall("joint")}
    notes = [*weld(robot, tuple(joints)), *mend_joints(robot), *mend_inertias(robot, stand or Stand())]
    spec = _compiled(path, robot)
    for geom in spec.geoms:
        geom.mass = 0.0  # else a shape of a link without mass would weigh as water does
    for name in joints:
        _drive(spec, name, drives, efforts[name])
    if unlimited := [name for name in joints if not efforts[name] > 0]:
        notes.append(f"no effort limit in the URDF, so the drive has none: {', '.join(unlimited)}")
    spec.compile()
    return Made(spec.to_xml(), tuple(notes))


def _compiled(path: Path, robot: Element) -> mujoco.MjSpec:
    extension = ElementTree.SubElement(robot, "mujoco")
    ElementTree.SubElement(extension, "compiler", {"fusestatic": "false", "discardvisual": "false"})
    try:
        spec = mujoco.MjSpec.from_string(ElementTree.tostring(robot, encoding="unicode"))
        spec.compile()
    except Exception as error:  # ValueError mostly; FatalError from its allocations
        raise BadInput(path, "a URDF that MuJoCo loads", " ".join(str(error).split())[:300]) from None
    return spec


def _require_joints(path: Path, robot: Element, joints: Sequence[str]) -> None:
    kinds = {str(joint.get("name")): str(joint.get("type")) for joint in robot.findall("joint")}
    can = [name for name, kind in kinds.items() if kind in MOVING]
    if not joints or len(set(joints)) < len(joints):
        raise BadInput("--joints", "joints of the log, each once", ", ".join(joints) or "none", _known(can))
    for name in joints:
        if name not in kinds:
            near = difflib.get_close_matches(name, can, 3)
            do = f"Near names: {', '.join(near)}." if near else _known(can)
            raise BadInput(f"{path}: --joints", "joints of the URDF", repr(name)[:80], do)
        if name not in can:
            raise BadInput(f"{path}: --joints: {name}", "a hinge or slide", f"a {kinds[name]} joint", _known(can))


def _known(names: Sequence[str]) -> str:
    return f"The URDF has {', '.join(names) or 'no joint that moves'}."[:300]


def _require_gains(joints: Sequence[str], drives: Drives) -> None:
    if drives.kind not in DRIVES:
        raise BadInput("--drive", " or ".join(DRIVES), repr(drives.kind)[:40])
    for option, gains, least in (("--kp", drives.kp, "above 0"), ("--kv", drives.kv, "of 0 or more")):
        if drives.kind == "torque":
            if gains:
                raise BadInput(option, "no gains with --drive torque", "some", "Say --drive position.")
            continue
        if unknown := sorted(set(gains) - {*joints, ""}):
            raise BadInput(option, "joints of --joints", repr(unknown[0])[:80])
        if absent := [name for name in joints if name not in gains and "" not in gains]:
            do = f"Declare what the drives are set to: {option} VALUE, or {option} JOINT=VALUE for each."
            raise BadInput(option, "a gain of every position drive", f"none of {', '.join(absent)}"[:200], do)
        if wrong := [value for value in gains.values() if not (0 <= value < 1e9) or (option == "--kp" and value == 0)]:
            raise BadInput(option, f"gains {least}", f"{wrong[0]:g}")


def _drive(spec: mujoco.MjSpec, name: str, drives: Drives, effort: float) -> None:
    """Give a joint an actuator that takes what the log has, limited by the URDF's effort where that is stated."""
    joint = spec.joint(name)
    joint.actfrclimited, joint.actfrcrange = mujoco.mjtLimited.mjLIMITED_FALSE, [0.0, 0.0]
    actuator = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
    if drives.kind == "position":
        kp, kv = (gains.get(name, gains.get("", 0.0)) for gains in (drives.kp, drives.kv))
        actuator.set_to_position(kp=kp, kv=kv)
    else:
        actuator.set_to_motor()
    if effort > 0:
        actuator.forcelimited, actuator.forcerange = mujoco.mjtLimited.mjLIMITED_TRUE, [-effort, effort]
