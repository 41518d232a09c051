"""A policy's contract in plain words: what it takes, what it gives, and what is done with that."""

import re
from collections.abc import Iterator
from typing import Any

import numpy as np

from bumblebee.tracking.observing.needs import READINGS
from bumblebee.tracking.observing.terms import TERMS

REFERENCE = "the reference at the end of the coming control step"
# Name of a part -> (what it is, unit, frame).
MEANINGS: dict[str, tuple[str, str, str]] = {
    "gravity_b": ("direction of gravity", "1", "base"),
    "root_lin_vel_b": ("velocity of the pelvis", "m/s", "base"),
    "root_ang_vel_b": ("angular velocity of the pelvis", "rad/s", "base"),
    "root_height": ("height of the pelvis above the floor", "m", "world"),
    "root_rotation_g": ("orientation of the pelvis, two columns of its matrix", "1", "world"),
    "joint_pos": ("joint angles", "rad", "joints"),
    "joint_vel": ("joint speeds", "rad/s", "joints"),
    "last_action": ("the previous output, zeros at the start", "1", "joints"),
    "key_pos_b": ("own key bodies from the pelvis", "m", "base"),
    "key_error_b": ("from own key bodies to the reference's", "m", "base"),
    "posture_error": ("from own key bodies to the reference's, each from its pelvis", "m", "each its base"),
    "ref_rotation": ("orientation of the reference, two columns of its matrix", "1", "base"),
    "ref_lin_vel_b": ("velocity of the reference", "m/s", "base"),
    "ref_lin_vel_o": ("velocity of the reference", "m/s", "reference's base"),
    "ref_ang_vel": ("angular velocity of the reference", "rad/s", "reference's base"),
    "ref_height": ("height of the reference above the floor", "m", "world"),
    "ref_joint_pos": ("servo targets that hold the reference against gravity", "rad", "joints"),
    "ref_joint_vel": ("joint speeds of the reference", "rad/s", "joints"),
    "target_joint_pos": ("joint angles of the reference", "rad", "joints"),
    "target_joint_vel": ("joint speeds of the reference", "rad/s", "joints"),
    "target_key_pos_g": ("key bodies of the reference from the pelvis", "m", "world's axes"),
    "target_root_pos_g": ("pelvis of the reference from the pelvis", "m", "world's axes"),
    "target_root_rotation_g": ("orientation of the reference, two columns of its matrix", "1", "world"),
    "target_root_pos_b": ("pelvis of the reference from the pelvis", "m", "base"),
    "target_root_rotation_b": ("orientation of the reference, two columns of its matrix", "1", "base"),
    "target_key_pos_b": ("key bodies of the reference from the pelvis", "m", "base"),
    "target_lin_vel_b": ("velocity of the reference", "m/s", "base"),
    "target_ang_vel": ("angular velocity of the reference", "rad/s", "reference's base"),
}
_AHEAD = {
    "root_pos_b": ("pelvis of the reference {seconds} s further on, from the pelvis", "m", "base"),
    "root_pos_o": ("pelvis of the reference {seconds} s further on, from its own before", "m", "reference's base"),
    "rotation": ("its orientation {seconds} s further on, two columns of its matrix", "1", "base"),
    "joint_pos": ("its joint angles {seconds} s further on", "rad", "joints"),
}


def meaning(name: str, ahead: list[float]) -> tuple[str, str, str]:
    """Meaning of a part of the observation, its unit and its frame; a term of a baseline says it in its own words."""
    if name in MEANINGS:
        return MEANINGS[name]
    further = re.fullmatch(r"ahead(\d+)_(\w+)", name)
    if further and further[2] in _AHEAD:
        index = int(further[1]) - 1
        seconds = f"{ahead[index]:g}" if index < len(ahead) else "some"
        what, unit, frame = _AHEAD[further[2]]
        return what.format(seconds=seconds), unit, frame
    said = (TERMS[name].__doc__ or "").strip().splitlines() if name in TERMS else []
    return said[0] if said else "not described", "", ""


def observation_size(contract: dict[str, Any]) -> int:
    """Entries of the observation, of all control steps that the policy sees."""
    newest = sum(part["size"] for part in contract.get("observation_now", []))
    return int(contract.get("history", 1) * sum(part["size"] for part in contract["observation"]) + newest)


def sensors_line(contract: dict[str, Any]) -> str:
    """One line of Markdown: the readings that the policy takes, and those that it does without."""
    taken = contract.get("sensors")
    if taken is None:
        return "Sensors: not said."
    without = ", ".join(name for name in READINGS if name not in taken)
    return f"Sensors: {', '.join(taken)}." + (f" Not needed: {without}." if without else "")


def observation_table(contract: dict[str, Any]) -> Iterator[str]:
    """Rows of Markdown: where in the observation each part lies, what it is, unit and frame."""
    ahead, history = [float(value) for value in contract.get("ahead", [])], int(contract.get("history", 1))
    yield "| entries | part | what | unit | frame |"
    yield "|---|---|---|---|---|"
    begin = 0
    for part in contract["observation"]:
        yield _row(begin, part, ahead)
        begin += part["size"]
    begin *= history
    for part in contract.get("observation_now", []):
        yield _row(begin, part, ahead)
        begin += part["size"]


def _row(begin: int, part: dict[str, Any], ahead: list[float]) -> str:
    return f"| {begin}:{begin + part['size']} | {part['name']} | {' | '.join(meaning(part['name'], ahead))} |"


def action_sentence(contract: dict[str, Any]) -> str:
    """Sentence on what becomes of an action."""
    action = contract["action"]
    if action.get("base", "reference") == "default":
        middle = "the stand pose (`default_pos` of contract.json)"
    elif action.get("feed_forward"):
        middle = f"the joint angles of {REFERENCE} plus what holds it against gravity (the observation's ref_joint_pos)"
    else:
        middle = f"the joint angles of {REFERENCE}"
    return (
        f"The target of each joint's position servo [rad] is {middle} plus scale times action; the servo gives "
        f"kp (target - angle) - kd speed, cut at the joint's torque limit, and holds a target for "
        f"{1000 / float(contract['control_hz']):g} ms."
    )


def joint_table(contract: dict[str, Any]) -> Iterator[str]:
    """Rows of Markdown: each joint in order with its scale and gains."""
    yield "| # | joint | scale [rad] | kp [N m/rad] | kd [N m s/rad] |"
    yield "|---|---|---|---|---|"
    columns = (contract["joints"], contract["action"]["scale"], contract["kp"], contract["kd"])
    for index, (name, scale, kp, kd) in enumerate(zip(*columns, strict=True)):
        yield f"| {index} | {name} | {np.round(scale, 4):g} | {np.round(kp, 2):g} | {np.round(kd, 2):g} |"
