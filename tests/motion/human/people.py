"""A made-up person for the tests: a walk-like motion as BVH text and as SMPL arrays."""

import io
from collections.abc import Sequence

import numpy as np

# name, parent, offset [m, y up, z ahead, x left]; None for a joint ends a chain.
JOINTS: tuple[tuple[str, str, tuple[float, float, float]], ...] = (
    ("Hips", "", (0, 0, 0)),
    ("LeftUpLeg", "Hips", (0.1, -0.05, 0)),
    ("LeftLeg", "LeftUpLeg", (0, -0.42, 0)),
    ("LeftFoot", "LeftLeg", (0, -0.42, 0)),
    ("LeftToeBase", "LeftFoot", (0, -0.055, 0.14)),
    ("RightUpLeg", "Hips", (-0.1, -0.05, 0)),
    ("RightLeg", "RightUpLeg", (0, -0.42, 0)),
    ("RightFoot", "RightLeg", (0, -0.42, 0)),
    ("RightToeBase", "RightFoot", (0, -0.055, 0.14)),
    ("Spine", "Hips", (0, 0.2, 0)),
    ("Spine1", "Spine", (0, 0.2, 0)),
    ("Neck", "Spine1", (0, 0.15, 0)),
    ("Head", "Neck", (0, 0.1, 0)),
    ("LeftShoulder", "Spine1", (0.05, 0.1, 0)),
    ("LeftArm", "LeftShoulder", (0.12, 0, 0)),
    ("LeftForeArm", "LeftArm", (0.28, 0, 0)),
    ("LeftHand", "LeftForeArm", (0.25, 0, 0)),
    ("RightShoulder", "Spine1", (-0.05, 0.1, 0)),
    ("RightArm", "RightShoulder", (-0.12, 0, 0)),
    ("RightForeArm", "RightArm", (-0.28, 0, 0)),
    ("RightHand", "RightForeArm", (-0.25, 0, 0)),
)
HIPS = 0.96  # height at which the feet stand flat: 0.07 m under the ankles [m]
COLUMNS = 6 + 3 * (len(JOINTS) - 1)


def hierarchy(scale: float = 100.0, names: dict[str, str] | None = None, turned: bool = False) -> str:
    """The skeleton; `turned` for z up (x left, y back)."""
    names = names or {}
    lines: list[str] = ["HIERARCHY"]

    def add(name: str, depth: int) -> None:
        x, y, z = (scale * value for value in next(offset for own, _, offset in JOINTS if own == name))
        x, y, z = (x, -z, y) if turned else (x, y, z)
        indent, said = "\t" * depth, names.get(name, name)
        lines.extend([f"{indent}{'JOINT' if depth else 'ROOT'} {said}", indent + "{", f"{indent}\tOFFSET {x} {y} {z}"])
        move = "Xposition Yposition Zposition " if not depth else ""
        lines.append(f"{indent}\tCHANNELS {3 if depth else 6} {move}Zrotation Yrotation Xrotation")
        below = [own for own, parent, _ in JOINTS if parent == name]
        for child in below:
            add(child, depth + 1)
        if not below:
            lines.extend([f"{indent}\tEnd Site", indent + "\t{", f"{indent}\t\tOFFSET 0 1 0", indent + "\t}"])
        lines.append(indent + "}")

    add("Hips", 0)
    return "\n".join(lines)


def rows(frames: int = 40, scale: float = 100.0, turned: bool = False) -> np.ndarray:
    """Values: the person stands, arms down, and sways with the arms."""
    values = np.zeros((frames, COLUMNS))
    values[:, 1] = scale * HIPS
    if turned:
        values[:, 2], values[:, 1] = values[:, 1].copy(), 0
    for name, sign in (("LeftArm", -1), ("RightArm", 1)):
        column = 6 + 3 * ([own for own, *_ in JOINTS].index(name) - 1)
        values[:, column + (1 if turned else 0)] = (-sign if turned else sign) * (
            75 + 5 * np.sin(np.arange(frames) / 9)
        )
    return values


def bvh(
    frames: int = 40,
    scale: float = 100.0,
    fps: float = 120.0,
    values: np.ndarray | None = None,
    names: dict[str, str] | None = None,
    turned: bool = False,
) -> str:
    """The file's text."""
    values = rows(frames, scale, turned) if values is None else values
    table = "\n".join(" ".join(f"{value:.6g}" for value in row) for row in values)
    return f"{hierarchy(scale, names, turned)}\nMOTION\nFrames: {len(values)}\nFrame Time: {1 / fps:.7f}\n{table}\n"


def smpl(frames: int = 40, width: int = 72, **changed: object) -> dict[str, object]:
    """AMASS's arrays of a person who stands, z up, and faces against y."""
    poses = np.zeros((frames, width))
    poses[:, 0] = np.pi / 2
    poses[:, 3 * 16 + 2], poses[:, 3 * 17 + 2] = -1.2 + 0.1 * np.sin(np.arange(frames) / 9), 1.2
    trans = np.tile([0.0, 0.0, 0.91], (frames, 1))
    fields = {"poses": poses, "trans": trans, "betas": np.zeros(16), "gender": "neutral", "mocap_framerate": 120.0}
    return {key: value for key, value in {**fields, **changed}.items() if value is not None}


def npz(arrays: dict[str, object], leave: Sequence[str] = ()) -> bytes:
    """The bytes of an .npz file."""
    stream = io.BytesIO()
    np.savez(stream, **{key: value for key, value in arrays.items() if key not in leave})
    return stream.getvalue()
