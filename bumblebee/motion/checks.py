"""What a motion file must satisfy before anything is made of it; each check names file, frame and remedy."""

from collections.abc import Callable

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.motion import quaternions
from bumblebee.motion.kinematics import lowest
from bumblebee.motion.raw import RawMotion
from bumblebee.robot.facts import joint_names

MIN_FRAMES = 10
_FULL_TURN = 2 * np.pi  # rad: no joint of the G1 goes half as far
_MAX_HEIGHT = 5.0  # m of the pelvis
_NORM_TOLERANCE = 0.02


def check_raw(raw: RawMotion) -> None:
    """All checks, in an order in which the first that fails names the cause.

    Raises:
        BadInput: too few frames, NaN or infinity, no unit quaternion, degrees, centimetres, quaternion order.
    """
    for check in CHECKS:
        check(raw)


def enough_frames(raw: RawMotion) -> None:
    """A motion of a few frames has no velocities to speak of."""
    frames = len(raw.root_pos)
    if frames < MIN_FRAMES:
        raise BadInput(raw.where, f"at least {MIN_FRAMES} frames", f"{frames} frame{'s' * (frames != 1)}")


def finite(raw: RawMotion) -> None:
    """No NaN, no infinity."""
    for values, columns in _named(raw):
        bad = np.argwhere(~np.isfinite(values))
        if len(bad):
            frame, column = bad[0]
            where = f"{raw.where}, {raw.row(frame)}, {columns[column]}"
            raise BadInput(where, "a finite number", str(values[frame, column]), f"{len(bad)} such values in the file.")


def unit_quaternions(raw: RawMotion) -> None:
    """The root's four numbers are a rotation."""
    norm = np.linalg.norm(raw.root_quat, axis=1)
    bad = np.flatnonzero(np.abs(norm - 1) > _NORM_TOLERANCE)
    if len(bad):
        where = f"{raw.where}, {raw.row(bad[0])}, root quaternion"
        raise BadInput(where, "length 1", f"{norm[bad[0]]:.3g}", "Are these the quaternion's columns?")


def radians(raw: RawMotion) -> None:
    """Joint angles beyond a full turn are degrees."""
    frame, joint = np.unravel_index(np.argmax(np.abs(raw.joint_pos)), raw.joint_pos.shape)
    value = raw.joint_pos[frame, joint]
    if abs(value) > _FULL_TURN:
        where = f"{raw.where}, {raw.row(int(frame))}, {joint_names()[joint]}"
        raise BadInput(where, "radians", f"{value:.4g}", "Degrees? Convert the angles to radians.")


def metres(raw: RawMotion) -> None:
    """A pelvis above 5 m is given in centimetres or millimetres."""
    height = float(np.median(raw.root_pos[:, 2]))
    if abs(height) > _MAX_HEIGHT:
        where = f"{raw.where}, root height"
        raise BadInput(where, "metres", f"{height:.4g} in the median", "Centimetres? Convert the position to metres.")


def quaternion_order(raw: RawMotion) -> None:
    """The file holds xyzw: read the other way round, the robot must not stand better.

    A robot that stands becomes one that lies or hangs in the air when the order is mistaken, so both readings are
    compared: by the pelvis's up axis, and by the distance of the robot's lowest point from the floor.
    On 110 real files read right, the other way was never the more upright one.
    """
    some = slice(None, None, max(1, len(raw.root_pos) // 200))
    as_read = quaternions.normalised(raw.root_quat[some])
    # `raw.root_quat` is the file's (x, y, z, w) moved to (w, x, y, z); if the file was wxyz, the move must be undone.
    other = as_read[:, [1, 2, 3, 0]]
    up, floor = _upright(as_read), _floor_error(raw, as_read, some)
    other_up, other_floor = _upright(other), _floor_error(raw, other, some)
    if other_up > up + 0.05 and other_floor < 0.6 * floor:
        raise BadInput(
            f"{raw.where}, root quaternion",
            "the order xyzw",
            f"wxyz (read as xyzw the robot lies or stands on its head: up axis {up:.2f}, as wxyz {other_up:.2f})",
            "Move w to the end.",
        )


CHECKS: tuple[Callable[[RawMotion], None], ...] = (
    enough_frames,
    finite,
    unit_quaternions,
    radians,
    metres,
    quaternion_order,
)


def _named(raw: RawMotion) -> list[tuple[np.ndarray, tuple[str, ...]]]:
    root_quat = tuple(f"root quaternion {axis}" for axis in "wxyz")
    root_pos = tuple(f"root position {axis}" for axis in "xyz")
    return [(raw.root_pos, root_pos), (raw.root_quat, root_quat), (raw.joint_pos, joint_names())]


def _upright(quat: np.ndarray) -> float:
    """Mean vertical component of the pelvis's up axis."""
    return float(quaternions.rotate(quat, [0.0, 0.0, 1.0])[:, 2].mean())


def _floor_error(raw: RawMotion, quat: np.ndarray, frames: slice) -> float:
    """Median distance of the robot's lowest point from the floor [m]."""
    return float(np.median(np.abs(lowest(raw.root_pos[frames], quat, raw.joint_pos[frames]))))
