"""Checks of a motion file before anything is made of it; each names file, frame and remedy."""

from collections.abc import Callable, Sequence

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.io.read import require_within
from bumblebee.motion.clip import Clip
from bumblebee.motion.kinematics import forward_key_positions
from bumblebee.motion.raw import RawMotion
from bumblebee.robot.facts import KEY_BODIES, joint_names

MIN_FRAMES = 10
MAX_FRAMES = 4_000_000  # of one motion: an hour at the fastest rate
_RATES = (1.0, 1000.0)  # Hz
_MAX_SECONDS = 3600.0
_REACH = 1000.0  # m from the world's origin
_KEY_ERROR = 0.02  # m between keypoints and what the joint angles say
_FULL_TURN = 2 * np.pi  # rad: no joint of the G1 goes half as far
_MAX_HEIGHT = 5.0  # m of the pelvis
NORM_TOLERANCE = 0.02
_SHORTEST = 0.9  # of a quaternion between two that were interpolated: they are 52 degrees apart


def check_raw(raw: RawMotion) -> None:
    """All checks, in an order in which the first that fails names the cause.

    Raises:
        BadInput: too few frames, NaN or infinity, no quaternions, degrees, centimetres.
    """
    for check in CHECKS:
        check(raw)


def enough_frames(raw: RawMotion) -> None:
    """A motion of a few frames has no velocities to speak of."""
    frames = len(raw.root_pos)
    if frames < MIN_FRAMES:
        raise BadInput(raw.where, f"at least {MIN_FRAMES} frames", f"{frames} frame{'s' * (frames != 1)}")


def frame_rate(raw: RawMotion) -> None:
    """A rate that motions have, and a length that resampling does not blow up."""
    _check_rate(raw.where, raw.fps, len(raw.root_pos))


def finite(raw: RawMotion) -> None:
    """No NaN, no infinity."""
    for values, columns in _named(raw):
        bad = np.argwhere(~np.isfinite(values))
        if len(bad):
            frame, column = bad[0]
            where = f"{raw.where}, {raw.row(frame)}, {columns[column]}"
            raise BadInput(where, "a finite number", str(values[frame, column]), f"{len(bad)} such values in the file.")


def quaternion_lengths(raw: RawMotion) -> None:
    """The root's four numbers are a rotation, or a mean of two: linear interpolation shortens quaternions."""
    with np.errstate(over="ignore"):
        norm = np.linalg.norm(raw.root_quat, axis=1)
    bad = np.flatnonzero((norm > 1 + NORM_TOLERANCE) | (norm < _SHORTEST))
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


def near(raw: RawMotion) -> None:
    """A robot that walks does not go further than a kilometre, nor jump there."""
    for axis, values in zip("xyz", raw.root_pos.T, strict=True):
        bad = np.flatnonzero(np.abs(values) > _REACH)
        if len(bad):
            where = f"{raw.where}, {raw.row(bad[0])}, root position {axis}"
            raise BadInput(where, f"at most {_REACH:g} m", f"{values[bad[0]]:.4g}")


CHECKS: tuple[Callable[[RawMotion], None], ...] = (
    enough_frames,
    frame_rate,
    finite,
    quaternion_lengths,
    radians,
    metres,
    near,
)


def check_clip(where: object, clip: Clip) -> None:
    """Check a clip that is read or written.

    Raises:
        BadInput: unequal lengths, a rate or a length that no motion has, NaN or infinity, values beyond all sense,
            quaternions of another length than 1, keypoints that do not belong to the joint angles.
    """
    check_clips([(where, clip)])


def check_clips(clips: Sequence[tuple[object, Clip]]) -> None:
    """Check (where, clip) of many at once, which is faster: the first that fails is named."""
    for where, clip in clips:
        _check_arrays(where, clip)
    if not clips:
        return
    some = [np.unique([0, clip.frames // 2, clip.frames - 1]) for _, clip in clips]
    fields = ("root_pos", "root_quat", "joint_pos", "key_pos")
    joined = [
        np.concatenate([getattr(clip, field)[frames] for (_, clip), frames in zip(clips, some, strict=True)])
        for field in fields
    ]
    errors = np.abs(joined[3] - forward_key_positions(*joined[:3])).max(axis=(1, 2))
    starts = np.cumsum([0, *(len(frames) for frames in some)])[:-1]
    worst = np.maximum.reduceat(errors, starts)
    if (bad := int(np.argmax(worst > _KEY_ERROR))) or worst[0] > _KEY_ERROR:
        came = f"{worst[bad]:.3g} m beside them"
        raise BadInput(f"{clips[bad][0]}: key_pos", "keypoints that follow from the joint angles", came)


def _check_arrays(where: object, clip: Clip) -> None:
    frames, sizes = clip.frames, {"root_pos": (3,), "root_quat": (4,), "joint_pos": (len(joint_names()),)}
    for field, size in {**sizes, "key_pos": (len(KEY_BODIES), 3)}.items():
        values = getattr(clip, field)
        if values.shape != (frames, *size) or not frames:
            raise BadInput(f"{where}: {field}", f"shape {('at least 1', *size)}", str(values.shape))
    _check_rate(where, clip.fps, frames)
    require_within(f"{where}: root_pos", clip.root_pos, _REACH, "m")
    require_within(f"{where}: root_quat", clip.root_quat, 1 + NORM_TOLERANCE)
    require_within(f"{where}: joint_pos", clip.joint_pos, 2 * _FULL_TURN, "rad")
    require_within(f"{where}: key_pos", clip.key_pos, _REACH + 10, "m")
    norm = np.linalg.norm(clip.root_quat, axis=1)
    bad = np.flatnonzero(np.abs(norm - 1) > NORM_TOLERANCE)
    if len(bad):
        raise BadInput(f"{where}: root_quat, row {bad[0]}", "length 1", f"{norm[bad[0]]:.3g}")


def _check_rate(where: object, fps: float, frames: int) -> None:
    if not _RATES[0] <= fps <= _RATES[1]:  # also for NaN
        raise BadInput(f"{where}: fps", f"frames a second from {_RATES[0]:g} to {_RATES[1]:g}", f"{fps:g}")
    if (frames - 1) / fps > _MAX_SECONDS:
        came = f"{(frames - 1) / fps:.0f} s"
        raise BadInput(where, f"a motion of at most {_MAX_SECONDS:g} s", came, "Cut it into parts.")


def _named(raw: RawMotion) -> list[tuple[np.ndarray, tuple[str, ...]]]:
    root_quat = tuple(f"root quaternion {axis}" for axis in "wxyz")
    root_pos = tuple(f"root position {axis}" for axis in "xyz")
    return [(raw.root_pos, root_pos), (raw.root_quat, root_quat), (raw.joint_pos, joint_names())]
