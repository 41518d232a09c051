"""Reads the `.npz` motions of mjlab, BeyondMimic and whole_body_tracking: joints and bodies, at a rate that is stated.

`fps`, `joint_pos` (T, J) [rad], `body_pos_w` (T, B, 3) [m], `body_quat_w` (T, B, 4) [wxyz]; velocities are not read.
The root is the pelvis among the bodies, all other kinematics is computed anew: simulators order joints and bodies
differently (`orders.py`). `joint_pos` may begin with the root as MuJoCo's qpos does: xyz [m], quaternion wxyz.
"""

from pathlib import Path

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.io.read import require_real
from bumblebee.motion.formats.config import RobotConfig
from bumblebee.motion.formats.orders import BREADTH, DEMAND, DEPTH, body_orders, columns_of, detect, joint_order
from bumblebee.motion.raw import RawMotion
from bumblebee.robot.facts import joint_names

_ROOT = 7
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
    fps = _fps(path, arrays)
    named = _named(path, arrays, joints.shape[1], options)
    bodies = _bodies(path, arrays, len(joints))
    if bodies is None:
        if root is None:
            came = ", ".join(sorted(arrays)[:12])[:160]
            raise BadInput(path, "body_pos_w (T, B, 3) and body_quat_w (T, B, 4)", f"only {came}")
        if len(named) > 1:
            raise BadInput(f"{path}, joint_pos", "the order of the joints", "no bodies that would tell it", DEMAND)
        (kind, names), note = next(iter(named.items())), ""
        columns, root_pos, root_quat = columns_of(names), root[:, :3], root[:, 3:]
    elif options.npz_joints and not body_orders(bodies[0].shape[1]):
        columns, root_pos, root_quat = columns_of(named[options.npz_joints]), bodies[0][:, 0], bodies[1][:, 0]
        kind, note = options.npz_joints, f" (as set); the first of {bodies[0].shape[1]} bodies taken for the root"
    else:
        order = detect(path, joints, *bodies, named)
        kind, columns, note = order.joints, order.columns, f"; bodies {order.bodies}, {order.error * 1000:.1f} mm apart"
        root_pos, root_quat = bodies[0][:, order.root], bodies[1][:, order.root]
        if order.quaternion == "xyzw":
            root_quat, note = root_quat[:, [3, 0, 1, 2]], f"{note}; quaternions xyzw"
    notes = (f"joints {_WORDS[kind]}{note}",)
    return RawMotion(path.stem, fps, root_pos, root_quat, joints[:, columns], path, first_row=0, notes=notes)


def _joints(path: Path, arrays: dict[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray | None]:
    """Joint angles (T, 29 or 23) [rad], and the root (T, 7) where it stands before them."""
    values = arrays["joint_pos"]
    where = f"{path}, joint_pos"
    if values.ndim != 2 or values.shape[1] not in (23, 29, _ROOT + 23, _ROOT + 29) or not len(values):
        wanted = "shape (T, 29) or (T, 23) with at least a frame, or 7 columns more with the root first"
        raise BadInput(where, wanted, str(values.shape)[:80])
    values = require_real(where, values)
    if values.shape[1] in (23, 29):
        return values, None
    return values[:, _ROOT:], values[:, :_ROOT]


def _fps(path: Path, arrays: dict[str, np.ndarray]) -> float:
    values = arrays.get("fps")
    if values is None or values.size != 1 or values.dtype.kind not in "iuf":
        came = "none" if values is None else f"shape {values.shape}, {values.dtype}"[:80]
        raise BadInput(f"{path}, fps", "one number of frames a second", came)
    fps = float(values.reshape(-1)[0])
    if not 1 <= fps <= 1000:
        raise BadInput(f"{path}, fps", "a number of frames a second from 1 to 1000", f"{fps:g}")
    return fps


def _named(path: Path, arrays: dict[str, np.ndarray], dof: int, options: RobotConfig) -> dict[str, tuple[str, ...]]:
    """The orders of the joints that come into question: the file's names, or the setting's, or both that are known."""
    names = arrays.get("joint_names")
    if names is not None:
        said = tuple(str(name).split("/")[-1] for name in names.reshape(-1)[:100]) if names.dtype.kind == "U" else ()
        said = tuple(name for name in said if "floating" not in name and name != "root")
        if len(said) != dof or len(set(said)) != dof or not set(joint_names()) <= set(said):
            came = f"{names.size} others, such as {', '.join(said[:3])}"[:160]
            raise BadInput(f"{path}, joint_names", f"the names of {dof} G1 joints", came)
        return {"": said}
    kinds = (options.npz_joints,) if options.npz_joints else (DEPTH, BREADTH)
    return {kind: joint_order(kind, dof) for kind in kinds}


def _bodies(path: Path, arrays: dict[str, np.ndarray], frames: int) -> tuple[np.ndarray, np.ndarray] | None:
    """Positions (T, B, 3) [m] and quaternions (T, B, 4) of the bodies; None without them."""
    if "body_pos_w" not in arrays or "body_quat_w" not in arrays:
        return None
    found = []
    for key, size in (("body_pos_w", 3), ("body_quat_w", 4)):
        values = arrays[key]
        if values.ndim != 3 or values.shape[0] != frames or values.shape[2] != size or not 1 <= values.shape[1] <= 200:
            raise BadInput(f"{path}, {key}", f"shape ({frames}, B, {size})", str(values.shape)[:80])
        found.append(require_real(f"{path}, {key}", values))
    if found[0].shape[1] != found[1].shape[1]:
        came = f"{found[0].shape[1]} and {found[1].shape[1]}"
        raise BadInput(path, "as many bodies in body_pos_w and body_quat_w", came)
    return found[0], found[1]
