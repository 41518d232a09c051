"""Mending of a URDF in place, where MuJoCo refuses it or takes it for something else; a line for each change."""

from dataclasses import dataclass
from xml.etree.ElementTree import Element, SubElement

import mujoco
import numpy as np

from bumblebee.measured.urdf.tree import MOVING, ends, number

_KEYS = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")


@dataclass(frozen=True)
class Stand:
    """Masses and inertias that stand for those which a URDF does not state."""

    mass: float = 1e-3
    """Mass of what moves and has none [kg]."""
    density: float = 1000.0
    """Density of the ball whose inertia stands for an unphysical one [kg/m^3]: a robot's links float nearly."""
    margin: float = 1e-6
    """Share by which a principal inertia stays below the sum of the others: rounding must not undo it."""


def weld(robot: Element, logged: tuple[str, ...]) -> list[str]:
    """Make every joint that can move and is not `logged` a fixed one."""
    held = [
        joint for joint in robot.findall("joint") if joint.get("type") != "fixed" and joint.get("name") not in logged
    ]
    for joint in held:
        joint.set("type", "fixed")
    names = ", ".join(str(joint.get("name")) for joint in held)
    return [f"joints that are not in --joints are held still at 0: {names}"] if held else []


def mend_joints(robot: Element) -> list[str]:
    """Drop ranges without width and negative damping and friction."""
    notes = []
    for joint in robot.findall("joint"):
        if joint.get("type") not in MOVING:
            continue
        limit, dynamics = joint.find("limit"), joint.find("dynamics")
        lower, upper = (number(limit, key) for key in ("lower", "upper"))
        if limit is not None and lower >= upper and joint.get("type") != "continuous":
            limit.attrib = {key: value for key, value in limit.attrib.items() if key == "effort"}
            notes.append(f"joint {joint.get('name')}: range {lower:g} to {upper:g} left out: it has no width")
        for key in ("damping", "friction"):
            if dynamics is not None and (value := number(dynamics, key)) < 0:
                dynamics.set(key, "0")
                notes.append(f"joint {joint.get('name')}: {key} {value:g} is negative: 0")
    return notes


def mend_inertias(robot: Element, stand: Stand) -> list[str]:
    """Give links inertias that a body can have, and a mass to what moves and has none."""
    links = {str(link.get("name")): link for link in robot.findall("link")}
    notes = [note for link in links.values() if (note := _mended(link, stand))]
    for name, group in _moved(robot).items():
        if not any(_mass(links[one]) > 0 for one in group):
            _set_inertial(links[name], stand.mass, _ball(stand.mass, stand))
            notes.append(f"link {name}: moves and has no mass: {stand.mass:g} kg")
    return notes


def _mended(link: Element, stand: Stand) -> str:
    """Mend one link's own inertia; the note, empty where there is nothing to mend."""
    inertial, name = link.find("inertial"), link.get("name")
    if inertial is None:
        return ""
    mass = _mass(link)
    if not mass > mujoco.mjMINVAL:
        link.remove(inertial)
        return f"link {name}: its mass is {mass:g} kg: left out"
    given = inertial.find("inertia")
    whole = _tensor(given)
    sizes, axes = np.linalg.eigh(whole)
    if sizes[0] <= mujoco.mjMINVAL:
        _set_inertial(link, mass, _ball(mass, stand))
        came = "none is stated" if given is None else f"{_words(sizes)} kg m^2 is none that a body can have"
        return f"link {name}: inertia: {came}: that of a ball of its mass"
    if sizes[0] + sizes[1] >= sizes[2]:
        return ""
    spread = np.maximum(sizes.sum() / 2 - sizes, stand.margin * sizes[2])  # of mass along each axis, never negative
    right = spread.sum() - spread
    _set_inertial(link, mass, axes @ np.diag(right) @ axes.T)
    return f"link {name}: inertia: {_words(sizes)} kg m^2 is none that a body can have: {_words(right)}"


def _moved(robot: Element) -> dict[str, list[str]]:
    """Link below each joint that moves -> the links that move as one body with it."""
    fixed: dict[str, list[str]] = {}
    for joint in robot.findall("joint"):
        if joint.get("type") == "fixed":
            parent, child = ends(joint)
            fixed.setdefault(parent, []).append(child)
    groups = {ends(joint)[1]: [ends(joint)[1]] for joint in robot.findall("joint") if joint.get("type") in MOVING}
    for group in groups.values():
        for link in group:  # grows while it is walked
            group.extend(fixed.get(link, []))
    return groups


def _set_inertial(link: Element, mass: float, inertia: np.ndarray) -> None:
    inertial = link.find("inertial")
    if inertial is None:
        inertial = SubElement(link, "inertial")
    for tag in ("mass", "inertia"):
        if (old := inertial.find(tag)) is not None:
            inertial.remove(old)
    SubElement(inertial, "mass", {"value": f"{mass:.9g}"})
    values = (*np.diag(inertia), inertia[0, 1], inertia[0, 2], inertia[1, 2])
    SubElement(inertial, "inertia", {key: f"{value:.12g}" for key, value in zip(_KEYS, values, strict=True)})


def _ball(mass: float, stand: Stand) -> np.ndarray:
    radius = (3 * mass / (4 * np.pi * stand.density)) ** (1 / 3)
    return 0.4 * mass * radius**2 * np.eye(3)


def _mass(link: Element) -> float:
    return number(link.find("inertial/mass"), "value")


def _tensor(inertia: Element | None) -> np.ndarray:
    xx, yy, zz, xy, xz, yz = (number(inertia, key) for key in _KEYS)
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _words(sizes: np.ndarray) -> str:
    return ", ".join(f"{size:.3g}" for size in sizes)
