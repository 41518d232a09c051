"""The links and joints of a URDF, read as plain data: nothing is executed, and no other file is opened."""

import math
from collections.abc import Iterable
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.io.read import read_text

MOVING = {"revolute": "hinge", "continuous": "hinge", "prismatic": "slide"}
"""Kinds of joints that a log has one column for."""
KINDS = (*MOVING, "fixed", "floating", "planar")
MOST_LINKS = 2_000  # MuJoCo follows a chain of links by recursion
_SHAPES = {"box": 3, "sphere": 1, "cylinder": 2, "capsule": 2}
_ATTRIBUTES = {
    "origin": ("xyz", "rpy"),
    "mass": ("value",),
    "inertia": ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"),
    "axis": ("xyz",),
    "limit": ("lower", "upper", "effort"),
    "dynamics": ("damping", "friction"),
    "box": ("size",),
    "sphere": ("radius",),
    "cylinder": ("radius", "length"),
    "capsule": ("radius", "length"),
}
"""Attributes that are read, all of them numbers."""


def read_robot(path: Path) -> Element:
    """The robot of a URDF: links with mass and primitive shapes, joints; meshes, colours and plugins are not in it.

    Raises:
        BadInput: no URDF, or one whose links and joints are no tree.
    """
    text = read_text(path)
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise BadInput(path, "a URDF without entities", "a document type of its own", "Take the <!DOCTYPE> out.")
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise BadInput(path, "a URDF, which is XML", f"text that is none ({error})"[:200]) from None
    if root.tag != "robot":
        raise BadInput(path, "a URDF, whose first element is <robot>", f"<{root.tag[:40]}>", _instead(root.tag))
    if "xacro" in text and any("xacro" in str(one.tag) for one in root.iter()):
        raise BadInput(path, "a URDF", "a xacro file", f"Expand it first: xacro {path.name} > robot.urdf")
    robot = Element("robot", {"name": root.get("name") or path.stem})
    robot.extend([_link(path, link) for link in root.findall("link")])
    robot.extend([_joint(path, joint) for joint in root.findall("joint")])
    _require_tree(path, robot)
    return robot


def _instead(tag: str) -> str:
    return "It is an MJCF: give it to --model as it is." if tag == "mujoco" else ""


def _link(path: Path, link: Element) -> Element:
    where = f"{path}: link {_name(path, link)!r}"
    made = Element("link", {"name": _name(path, link)})
    if (inertial := link.find("inertial")) is not None:
        made.append(_copied(where, inertial, "inertial", ("origin", "mass", "inertia")))
    for collision in link.findall("collision"):
        shape = next((one for one in collision.findall("geometry/*") if one.tag in _SHAPES), None)
        if shape is not None:
            kept = _copied(where, collision, "collision", ("origin",))
            geometry = Element("geometry")
            geometry.append(_numbers(where, shape))
            kept.append(geometry)
            made.append(kept)
    return made


def _joint(path: Path, joint: Element) -> Element:
    name, kind = _name(path, joint), joint.get("type", "")
    where = f"{path}: joint {name!r}"
    if kind not in KINDS:
        raise BadInput(f"{where}: type", f"one of {', '.join(KINDS)}", repr(kind)[:40])
    made = _copied(where, joint, "joint", ("origin", "axis", "limit", "dynamics"))
    made.attrib = {"name": name, "type": kind}
    for end in ("parent", "child"):
        found = joint.find(end)
        if found is None or not found.get("link"):
            raise BadInput(f"{where}: {end}", "the link that it names", "none")
        made.append(Element(end, {"link": str(found.get("link"))}))
    axis = made.find("axis")
    if kind in MOVING and axis is not None and not np.any(numbers(axis, "xyz")):
        raise BadInput(f"{where}: axis", "a direction", "0 0 0")
    return made


def _name(path: Path, element: Element) -> str:
    if not element.get("name"):
        raise BadInput(path, f"a name of every {element.tag}", "one without")
    return str(element.get("name"))


def _copied(where: str, source: Element, tag: str, inner: Iterable[str]) -> Element:
    """A new element with the numbers of those elements in `source` that count."""
    made = Element(tag)
    made.extend([_numbers(where, found) for name in inner if (found := source.find(name)) is not None])
    return made


def _numbers(where: str, element: Element) -> Element:
    """A copy of an element with those of its attributes that are read, each finite numbers."""
    kept = {key: element.get(key, "") for key in _ATTRIBUTES[element.tag] if element.get(key) is not None}
    for key, text in kept.items():
        try:
            wrong = not all(math.isfinite(float(part)) for part in text.split())
        except ValueError:
            wrong = True
        if wrong:
            raise BadInput(f"{where}: {element.tag} {key}", "finite numbers", repr(text)[:60])
    return Element(element.tag, kept)


def numbers(element: Element, key: str) -> np.ndarray:
    """The numbers of an attribute; empty where it is missing."""
    return np.array([float(part) for part in element.get(key, "").split()])


def number(element: Element | None, key: str) -> float:
    """The first number of an attribute; 0 where it or its element is missing, as URDF has it."""
    found = numbers(element, key) if element is not None else np.zeros(0)
    return float(found[0]) if found.size else 0.0


def _require_tree(path: Path, robot: Element) -> None:
    """Refuse names that stand twice, joints between links that are not there, loops and loose parts."""
    links, joints = [one.get("name") for one in robot.findall("link")], robot.findall("joint")
    if not 0 < len(links) <= MOST_LINKS:
        raise BadInput(path, f"1 to {MOST_LINKS:,} links", str(len(links)))
    for kind, names in (("link", links), ("joint", [one.get("name") for one in joints])):
        if twice := sorted({str(name) for name in names if names.count(name) > 1}):
            raise BadInput(path, f"each {kind} once", f"{twice[0]!r} twice")
    above: dict[str, str] = {}
    for joint in joints:
        parent, child = ends(joint)
        for name in (parent, child):
            if name not in links:
                raise BadInput(f"{path}: joint {joint.get('name')!r}", "links of the file", repr(name)[:80])
        if child in above:
            raise BadInput(f"{path}: link {child!r}", "one joint above it", "two")
        above[child] = parent
    roots = [str(name) for name in links if name not in above]
    if len(roots) != 1:
        came = f"{len(roots)}: {', '.join(roots[:3])}" if roots else "none: the links hang in a loop"
        raise BadInput(path, "one link that hangs on no joint", came)
    reached, waiting = {roots[0]}, [roots[0]]
    below: dict[str, list[str]] = {}
    for child, parent in above.items():
        below.setdefault(parent, []).append(child)
    while waiting:
        for child in below.get(waiting.pop(), []):
            reached.add(child)
            waiting.append(child)
    if loop := sorted(set(above) - reached):
        raise BadInput(f"{path}: link {loop[0]!r}", f"a chain of joints down from {roots[0]}", "a loop of its own")


def ends(joint: Element) -> tuple[str, str]:
    """Names of a joint's parent link and child link."""
    parent, child = joint.find("parent"), joint.find("child")
    assert parent is not None and child is not None  # `_joint` has seen to it
    return parent.get("link", ""), child.get("link", "")
