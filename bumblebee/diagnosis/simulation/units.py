"""Units in the documents and reports, by the kind of the joint; hinges and slides are never added up in silence.

A robot may have both. The contract's overall value of an error is the root mean square over all joints, in which 1 m
counts as 1 rad; beside it `by_kind` has hinges and slides apart, and the reports show these.
"""

from collections.abc import Iterator, Mapping
from typing import Any

import mujoco

from bumblebee.diagnosis.simulation.plant import Plant
from bumblebee.effects.units import joint_unit
from bumblebee.sim.effects import CATALOGUE

_SLIDE = int(mujoco.mjtJoint.mjJNT_SLIDE)
KINDS = {"hinge": False, "slide": True}
_THOUSANDTH = {"hinge": "mrad", "slide": "mm"}
MIXED = (
    "hinges and slides: they are reported separately; where one number stands for all joints (joint_pos_rmse, "
    "joint_vel_rmse), 1 mm counts as 1 mrad"
)
MEASURES = {
    "joint_pos_rmse": ("joint position", "mrad", 1e3),
    "joint_vel_rmse": ("joint velocity", "rad/s", 1.0),
    "base_pos_rmse": ("base position", "mm", 1e3),
    "base_rot_rmse": ("base rotation", "mrad", 1e3),
    "chi2": ("chi-square (1 = at the noise)", "", 1.0),
}
"""Measure of the error block -> its name, its unit on hinges and the factor from SI."""


def is_slide(plant: Plant, joint: str) -> bool:
    """Whether a joint of the plant is a slide."""
    return int(plant.model.jnt_type[plant.model.joint(joint).id]) == _SLIDE


def unit_on(plant: Plant, effect: str, where: str, hinge: str) -> str:
    """The unit of a parameter, `hinge` in the catalogue, of an effect on a place of the plant."""
    on_joint = CATALOGUE[effect].on == "joint" and where in plant.joints
    return joint_unit(hinge, on_joint and is_slide(plant, where))


def joint_units(plant: Plant) -> dict[str, dict[str, str]]:
    """Joint -> its units, for the documents: position, velocity, torque."""
    quantities = {"position": "rad", "velocity": "rad/s", "torque": "N m"}
    return {
        joint: {name: joint_unit(unit, is_slide(plant, joint)) for name, unit in quantities.items()}
        for joint in plant.joints
    }


def members(plant: Plant) -> dict[str, list[int]]:
    """Kind of joint -> columns of its joints, the kinds that the plant has."""
    found = {
        kind: [j for j, name in enumerate(plant.joints) if is_slide(plant, name) == slide]
        for kind, slide in KINDS.items()
    }
    return {kind: columns for kind, columns in found.items() if columns}


def mixed_notes(plant: Plant) -> list[str]:
    """Notes on overall values where a robot has hinges and slides."""
    return [MIXED] if len(members(plant)) > 1 else []


def of_joint(document: Mapping[str, Any], joint: str, quantity: str) -> str:
    """The unit of a quantity of a joint, as a document says it; a hinge's where it does not."""
    defaults = {"position": "rad", "velocity": "rad/s", "torque": "N m"}
    return document.get("units", {}).get(joint, defaults)[quantity]


def named(document: Mapping[str, Any], joint: str) -> str:
    """A joint with the unit of its position error, for a row of thousandths."""
    return f"{joint} [m{of_joint(document, joint, 'position')}]"


def rows(measures: Mapping[str, Any]) -> Iterator[tuple[str, str, float, tuple[str, str]]]:
    """Rows of one horizon: what it is, unit, factor from SI, and the key for `pick`."""
    for name in (m for m in measures if m in MEASURES):
        label, hinge, scale = MEASURES[name]
        entry = measures[name]
        if "by_kind" in entry:
            for kind in entry["by_kind"]:
                yield f"{label}, {kind}s", joint_unit(hinge, KINDS[kind]), scale, (name, kind)
        else:
            yield label, joint_unit(hinge, entry.get("unit") in ("m", "m/s")), scale, (name, "")


def pick(measures: Mapping[str, Any], key: tuple[str, str]) -> dict[str, Any]:
    """The value with its interval that a row of `rows` is about; empty where there is none."""
    entry = measures.get(key[0]) or {}
    return entry.get("by_kind", {}).get(key[1], {}) if key[1] else entry


def position_rows(measures: Mapping[str, Any]) -> list[tuple[str, str, float, tuple[str, str]]]:
    """The rows of joint positions alone: "joints", or "hinges" and "slides"."""
    some = [row for row in rows(measures) if row[3][0] == "joint_pos_rmse"]
    return [(f"{key[1]}s" if key[1] else "joints", unit, scale, key) for _, unit, scale, key in some]


def motion_error(motion: Mapping[str, Any]) -> str:
    """The joint position error of one motion of a gap report with its unit, hinges and slides apart."""
    errors = {kind: value for kind, value in motion["by_kind"].items() if value is not None}
    return ", ".join(f"{1e3 * value:.3g} {_THOUSANDTH[kind]}" for kind, value in errors.items()) or "-"
