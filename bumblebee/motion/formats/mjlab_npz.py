"""Reads the `.npz` motions of mjlab, BeyondMimic, whole_body_tracking and Isaac Lab: joints, and bodies or the root.

`fps`, `joint_pos` (T, J) [rad], `body_pos_w` (T, B, 3) [m], `body_quat_w` (T, B, 4) [wxyz]; velocities are not read.
The root is the pelvis among the bodies, all other kinematics is computed anew: simulators order joints and bodies
differently (`orders.py`). Without bodies the root is `base_pos_w` (T, 3) [m] and `base_quat_w` (T, 4), as Isaac Lab
exports it, `root_pos` and `root_quat_wxyz`, as `motions retarget` writes it, or it stands before the joints as in
MuJoCo's qpos: xyz [m], quaternion wxyz.
"""

from pathlib import Path
from typing import Literal

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.io.read import require_real
from bumblebee.motion.formats.config import RobotConfig
from bumblebee.motion.formats.layouts import arranged, layouts, notes_of, require_joints, sizes
from bumblebee.motion.formats.orders import BREADTH, DEPTH, body_orders, demand, detect, joint_order
from bumblebee.motion.rates import RATES, rate_in
from bumblebee.motion.raw import RawMotion, as_wxyz
from bumblebee.robot.facts import ROBOT

_ROOT = 7
_ROOTS = (("base_pos_w", "base_quat_w"), ("root_pos", "root_quat_wxyz"))
_MOST_BODIES = 200
_WORDS = {DEPTH: "depth-first as in MuJoCo", BREADTH: "breadth-first as in Isaac", "": "as the file names them"}


def is_mjlab(arrays: dict[str, np.ndarray]) -> bool:
    """Whether an `.npz` file has the keys of these motions."""
    return "joint_pos" in arrays


def read_mjlab_npz(path: Path, arrays: dict[str, np.ndarray], options: RobotConfig | None = None) -> RawMotion:
    """One motion.

    Args:
        path: the file.
        arrays: what it holds, by name.
        options: the order of the joints, where the bodies do not tell it.
    """
    options = options or RobotConfig()
    joints, root = _joints(path, arrays)
    fps = rate_in(path, arrays)
    if fps is None:
        do = "Add it to the file: an array `fps` of one number."
        raise BadInput(f"{path}: fps", f"one number of frames a second ({', '.join(RATES)})", "none", do)
    named = _named(path, arrays, joints.shape[1], options)
    bodies = _bodies(path, arrays, len(joints), ("body_pos_w", "body_quat_w"), "B, ")
    root = root or next(filter(None, (_bodies(path, arrays, len(joints), keys) for keys in _ROOTS)), None)
    if bodies is not None and root is not None and not body_orders(bodies[0].shape[1]):
        bodies = None  # the root is known without them
    order: str = options.quaternion or "wxyz"
    said_by: Literal["", "file", "known"] = "known" if options.quaternion else ""
    if bodies is None:
        if root is None:
            came = ", ".join(sorted(arrays)[:12])[:160]
            wanted = "body_pos_w (T, B, 3) and body_quat_w (T, B, 4), or base_pos_w (T, 3) and base_quat_w (T, 4)"
            raise BadInput(path, wanted, f"only {came}")
        if len(named) > 1:
            raise BadInput(
                f"{path}, joint_pos", "the order of the joints", "no bodies that would tell it", demand(named)
            )
        (kind, names), note = next(iter(named.items())), ""
        root_pos, root_quat = root
    elif options.npz_joints and not body_orders(bodies[0].shape[1]):
        if len(named) > 1:
            raise BadInput(f"{path}, joint_pos", "the order of the joints", "bodies that do not tell it", demand(named))
        kind, names = next(iter(named.items()))
        root_pos, root_quat = bodies[0][:, 0], bodies[1][:, 0]
        note = f" (as set); the first of {bodies[0].shape[1]} bodies taken for the root"
    else:
        found = detect(path, joints, *bodies, named)
        kind, names, order, said_by = found.joints, found.names, found.quaternion, "file"
        note = f"; bodies {found.bodies}, {found.error * 1000:.1f} mm apart"
        note += "; quaternions xyzw" if order == "xyzw" else ""
        root_pos, root_quat = bodies[0][:, found.root], bodies[1][:, found.root]
    notes = (f"joints {_WORDS[kind.split()[0] if kind else '']}{note}", *notes_of(names))
    return RawMotion(
        path.stem, fps, root_pos, as_wxyz(root_quat, order), arranged(joints, names), path, first_row=0, notes=notes,
        quat_order=order, order_from=said_by,
    )  # fmt: skip


def _joints(path: Path, arrays: dict[str, np.ndarray]) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray] | None]:
    """Joint angles (T, J) [rad], and the root (T, 3), (T, 4) where it stands before them."""
    values = arrays["joint_pos"]
    where = f"{path}, joint_pos"
    if values.ndim != 2 or not {values.shape[1], values.shape[1] - _ROOT} & {*sizes()} or not len(values):
        known = " or ".join(f"(T, {count})" for count in sizes())
        wanted = f"shape {known} with at least a frame, or 7 columns more with the root first"
        raise BadInput(where, wanted, str(values.shape)[:80])
    values = require_real(where, values)
    if values.shape[1] in sizes():
        return values, None
    return values[:, _ROOT:], (values[:, :3], values[:, 3:_ROOT])


def _named(path: Path, arrays: dict[str, np.ndarray], dof: int, options: RobotConfig) -> dict[str, tuple[str, ...]]:
    """The orders of the joints that come into question: the file's names, else those that settings leave open."""
    names = arrays.get("joint_names")
    if names is not None:
        said = tuple(str(name).split("/")[-1] for name in names.reshape(-1)[:100]) if names.dtype.kind == "U" else ()
        said = tuple(name for name in said if "floating" not in name and name != "root")
        require_joints(f"{path}, joint_names", said)
        if len(said) != dof:
            raise BadInput(f"{path}, joint_names", f"the names of {dof} joints of {ROBOT}", str(len(said)))
        return {"": said}
    kinds = (options.npz_joints,) if options.npz_joints else (DEPTH, BREADTH)
    known = {name: joints for name, joints in layouts(dof).items() if options.joints_23 in ("", name) or not name}
    return {f"{kind} {name}".strip(): joint_order(kind, joints) for kind in kinds for name, joints in known.items()}


def _bodies(
    path: Path, arrays: dict[str, np.ndarray], frames: int, keys: tuple[str, str], bodies: str = ""
) -> tuple[np.ndarray, np.ndarray] | None:
    """Positions (T, [B,] 3) [m] and quaternions (T, [B,] 4) of the bodies, or the root alone; None without them."""
    if any(key not in arrays for key in keys):
        return None
    found = []
    for key, size in zip(keys, (3, 4), strict=True):
        values = arrays[key]
        fits = values.ndim == 2 + bool(bodies) and (len(values), values.shape[-1]) == (frames, size)
        if not fits or not 1 <= max(values.shape[1:-1], default=1) <= _MOST_BODIES:
            raise BadInput(f"{path}, {key}", f"shape ({frames}, {bodies}{size})", str(values.shape)[:80])
        found.append(require_real(f"{path}, {key}", values))
    if found[0].shape[:-1] != found[1].shape[:-1]:
        came = f"{found[0].shape[1]} and {found[1].shape[1]}"
        raise BadInput(path, f"as many bodies in {keys[0]} and {keys[1]}", came)
    return found[0], found[1]
