"""One made-up person on any skeleton: names, extra joints, pose at rest, axes and unit differ, the motion does not.

A skeleton is given as chains of `name=point`: each joint lies in a point of the person, and turns as the part of the
body does to which the point belongs.
"""

from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

HIPS = 0.93  # height [m]
# Points at rest, arms level [m, from the hips; y up, z ahead, x to the left], and the part of the body that they turn
# with. A point's own place belongs to the part before it. Those of limbs are the left ones.
_TRUNK = {
    "Hips": ((0, 0, 0), "Hips"), "Spine": ((0, 0.1, 0), "Spine"), "S2": ((0, 0.2, 0), "Spine"),
    "S3": ((0, 0.3, 0), "Spine"), "Chest": ((0, 0.4, 0), "Spine"), "Neck": ((0, 0.52, 0), "Spine"),
    "Neck2": ((0, 0.57, 0), "Spine"), "Head": ((0, 0.62, 0.01), "Head"), "HeadEnd": ((0, 0.8, 0.01), "Head"),
    "Eye": ((0.03, 0.7, 0.08), "Head"), "Tail": ((0, 0, -0.2), "Hips"), "Pack": ((0, 0.3, -0.9), "Spine"),
}  # fmt: skip
_LIMBS = {
    "Buttock": ((0.05, -0.03, 0), "Hips"), "UpLeg": ((0.1, -0.05, 0), "UpLeg"), "MidUpLeg": ((0.1, -0.25, 0), "UpLeg"),
    "Leg": ((0.1, -0.47, 0), "Leg"), "Foot": ((0.1, -0.89, 0), "Foot"), "Heel": ((0.1, -0.94, -0.05), "Foot"),
    "ForeFoot": ((0.1, -0.92, 0.07), "Foot"), "Toe": ((0.1, -0.945, 0.14), "Foot"),
    "ToeEnd": ((0.1, -0.945, 0.2), "Foot"),
    "Collar": ((0.05, 0.48, 0), "Spine"), "Arm": ((0.17, 0.48, 0), "Arm"), "MidArm": ((0.3, 0.48, 0), "Arm"),
    "ForeArm": ((0.45, 0.48, 0), "ForeArm"), "MidForeArm": ((0.6, 0.48, 0), "ForeArm"),
    "Hand": ((0.7, 0.48, 0), "Hand"), "Finger": ((0.79, 0.48, 0), "Hand"), "FingerEnd": ((0.88, 0.48, 0), "Hand"),
    "Thumb": ((0.72, 0.48, 0.05), "Hand"), "ThumbEnd": ((0.75, 0.48, 0.1), "Hand"), "Sword": ((0.7, 1.6, 0), "Hand"),
}  # fmt: skip
_PARTS = (("Hips", ""), ("Spine", "Hips"), ("Head", "Spine"), ("UpLeg", "Hips"), ("Leg", "UpLeg"), ("Foot", "Leg"),
          ("Arm", "Spine"), ("ForeArm", "Arm"), ("Hand", "ForeArm"))  # fmt: skip
GROUND = "Ground"
"""A point that stays in the world's origin."""
Z_UP = Rotation.from_euler("x", 90, degrees=True)


@dataclass(frozen=True)
class Rig:
    """How a file writes the person."""

    scale: float = 100.0
    world: Rotation = field(default_factory=Rotation.identity)
    """From y up, facing z, to the file's axes and the way that the person faces."""
    rest: str = "T"
    """The pose with all angles 0: `T`, `down` (arms) or `line` (each bone along x, as some exporters have it)."""
    order: str = "ZXY"
    positions: bool = False
    """Whether every joint has position channels."""
    frames: int = 40


def write(joints: list[tuple[str, str, str]], rig: Rig | None = None) -> str:
    """BVH of joints (name, parent, point), parents first; an end of a chain is a joint named `end`."""
    rig = rig or Rig()
    rest, places, turns = _motion(rig.frames)
    rows = [(name, next((i for i in range(n) if joints[i][0] == parent), -1), point)
            for n, (name, parent, point) in enumerate(joints)]  # fmt: skip
    below = [[i for i, (_, parent, _) in enumerate(rows) if parent == n] for n in range(len(rows))]
    turned = [_turn_at_rest(rig, rest, point, [rows[i][2] for i in below[n]]) for n, (_, _, point) in enumerate(rows)]
    own = [rig.world * turns[point] * turned[n].inv() for n, (_, _, point) in enumerate(rows)]
    text, table = [], []

    def add(n: int, depth: int) -> None:
        name, parent, point = rows[n]
        at = rig.scale * rig.world.apply(places[point])
        offset, moves = np.zeros(3), True
        if parent >= 0:
            before = rows[parent][2]
            offset = rig.scale * turned[parent].apply(rest[point] - rest[before])
            local = own[parent].inv().apply(at - rig.scale * rig.world.apply(places[before]))
            moves, at = rig.positions or bool(np.abs(local - offset).max() > 1e-6 * rig.scale), local
        pad = "\t" * depth
        text.append(f"{pad}End Site" if name == "end" else f"{pad}{'JOINT' if depth else 'ROOT'} {name}")
        text.extend([pad + "{", f"{pad}\tOFFSET {' '.join(f'{value:.9g}' for value in offset)}"])
        if name != "end":
            axes = " ".join(f"{axis}rotation" for axis in rig.order)
            text.append(f"{pad}\tCHANNELS {'6 Xposition Yposition Zposition' if moves else 3} {axes}")
            turn = own[n] if parent < 0 else own[parent].inv() * own[n]
            table.extend([at] * moves + [turn.as_euler(rig.order, degrees=True, suppress_warnings=True)])
            for child in below[n]:
                add(child, depth + 1)
        text.append(pad + "}")

    add(0, 0)
    values = "\n".join(" ".join(f"{value:.9g}" for value in row) for row in np.concatenate(table, axis=1))
    return "\n".join(["HIERARCHY", *text, "MOTION", f"Frames: {rig.frames}", "Frame Time: 0.02", values, ""])


def chains(*texts: str, sides: str = "Left|Right") -> list[tuple[str, str, str]]:
    """Joints of chains `parent: name=point, name=point`; a chain with `{}` stands for both sides."""
    joints: list[tuple[str, str, str]] = []
    for text in texts:
        for side, word in zip("LR", sides.split("|"), strict=True) if "{}" in text else [("", "")]:
            parent, _, chain = text.replace("{}", word).rpartition(": ")
            for one in chain.split(", "):
                name, _, point = one.partition("=")
                joints.append((name, parent, side * (point in _LIMBS) + point))
                parent = name
    return joints


def _motion(frames: int) -> tuple[dict, dict, dict]:
    """For each point: its place at rest, its places (T, 3) [m], and the turns (T) of its part; y up, facing z."""
    time = np.arange(frames) * 0.02
    sway, lift = np.sin(2 * np.pi * 0.8 * time), 0.5 - 0.5 * np.cos(2 * np.pi * 0.8 * time)
    still = 0 * time
    angles = {
        "Hips": np.c_[8 * sway, 4 * lift, still], "Spine": np.c_[10 * sway, 5 * lift, 3 * sway],
        "Head": np.c_[20 * sway, 5 * lift, still], "UpLeg": np.c_[still, -25 - 10 * lift, 3 + still],
        "Leg": np.c_[still, 45 + 15 * lift, still], "Foot": np.c_[still, -20 - 5 * lift, -3 + still],
        "Arm": np.c_[-20 * sway, 10 * lift, -65 - 5 * sway], "ForeArm": np.c_[-30 - 20 * lift, still, still],
        "Hand": np.c_[still, still, 10 * sway],
    }  # fmt: skip
    turns, rest, places = {}, {}, {}
    for side, mirror in (("L", [1, 1, 1]), ("R", [-1, 1, -1])):
        for part, parent in _PARTS:
            key, above = (f"{side}{name}" if name in _LIMBS else name for name in (part, parent))
            local = Rotation.from_euler("YXZ", angles[part] * mirror if key != part else angles[part], degrees=True)
            turns[key] = turns[above] * local if parent else local
    places["Hips"] = np.c_[0.05 * sway, HIPS - 0.03 + 0.02 * sway, 0.05 * time]
    for side, mirror in (("", [1, 1, 1]), ("L", [1, 1, 1]), ("R", [-1, 1, 1])):
        for point, (at, _) in (_LIMBS if side else _TRUNK).items():
            rest[side + point] = np.array(at, float) * (mirror if side else [1, 1, 1])
    joints = {"Hips": "", "Spine": "Hips", "Head": "Spine"}
    joints |= {
        f"{s}{part}": (f"{s}{parent}" if parent in _LIMBS else parent) for s in "LR" for part, parent in _PARTS[3:]
    }
    for joint, parent in joints.items():
        if parent:
            places[joint] = places[parent] + turns[parent].apply(rest[joint] - rest[parent])
    for side in ("", "L", "R"):
        for point, (_, part) in (_LIMBS if side else _TRUNK).items():
            key = side + part if part in _LIMBS else part
            turns[side + point] = turns[key]
            places[side + point] = places[key] + turns[key].apply(rest[side + point] - rest[key])
    turns[GROUND] = Rotation.identity(frames)
    return rest | {GROUND: np.array([0, -HIPS, 0])}, places | {GROUND: np.zeros((frames, 3))}, turns


def _turn_at_rest(rig: Rig, rest: dict, point: str, children: list[str]) -> Rotation:
    """How a joint of the file is turned at rest against the person's level arms."""
    if rig.rest == "down" and point[1:] in ("Arm", "MidArm", "ForeArm", "MidForeArm", "Hand", "Finger", "Thumb"):
        return rig.world * Rotation.from_euler("z", -80 if point[0] == "L" else 80, degrees=True)
    bones = [rest[child] - rest[point] for child in children]
    if rig.rest == "line" and len(bones) == 1 and np.linalg.norm(bones[0]):
        return Rotation.align_vectors([[1, 0, 0]], [bones[0] / np.linalg.norm(bones[0])])[0]
    return rig.world
