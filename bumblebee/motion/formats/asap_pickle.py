"""Reads motions of the G1 from pickles: ASAP's, PHC's and H2O's layout, GMR's and TWIST's, one or many in a file.

All have root quaternions xyzw and Unitree's order of joints. ASAP, PHC and H2O name their fields `root_trans_offset`,
`root_rot`, `dof`, `pose_aa`, `fps`; GMR and TWIST `root_pos`, `root_rot`, `dof_pos`, `fps`. `pose_aa` holds a rotation
vector for each body, the root's first: where the joint angles or the root's quaternion are missing they come from it.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from bumblebee import quaternions
from bumblebee.errors import BadInput
from bumblebee.io.read import require_real
from bumblebee.motion.formats import safe_pickle
from bumblebee.motion.formats.config import RobotConfig
from bumblebee.motion.formats.layouts import arranged, layout_of, layouts, notes_of, require_joints, sizes
from bumblebee.motion.formats.others import refuse_known
from bumblebee.motion.raw import RawMotion, as_wxyz
from bumblebee.motion.reading.remedy import say
from bumblebee.motion.texts import shown
from bumblebee.robot.facts import joints

# Of all motions of a file together; a pickle may name one array many times.
_MAX_FRAMES = 5_000_000
_MAX_SECONDS = 4 * 3600.0
_EXTENDED = 3  # bodies without a joint that ASAP appends to `pose_aa`: both hands and the head
_OFF_AXIS = 1e-3  # rad of a rotation that is not about the joint's axis
_APART = 0.02  # rad between two rotations that are the same

# What we call it -> what the field calls it, ASAP's name first, then GMR's.
_FIELDS = {
    "root_pos": ("root_trans_offset", "root_pos", "root_trans"),
    "root_quat": ("root_rot", "root_quat"),
    "joint_pos": ("dof", "dof_pos"),
}
JOINT_FIELDS = _FIELDS["joint_pos"]
_NAMES = ("joint_names", "dof_names")


def read_asap_pickle(path: Path, data: bytes | None = None, options: RobotConfig | None = None) -> list[RawMotion]:
    """All motions of one pickle: `{name: {root_trans_offset, root_rot, dof, fps}}`, or one such inner dict.

    Args:
        path: the file.
        data: its bytes, where they have been read.
        options: what the file may leave unsaid.
    """
    content = safe_pickle.load(path, data)
    if not isinstance(content, dict) or not content:
        raise BadInput(path, "a dict of motions", f"a {type(content).__name__}")
    refuse_known(path, content)
    return read_fields(path, content, options)


def read_fields(path: Path, content: dict, options: RobotConfig | None = None) -> list[RawMotion]:
    """The motions of a dict of motions, or of the fields of a single one."""
    options = options or RobotConfig()
    if is_motion(content):
        content, several = {"": content}, False
    else:
        several = len(content) > 1
    _bounded(path, content)
    return [
        _motion(
            path,
            f"{path.stem}_{_said(name)}" if several else path.stem,
            _said(name) if several else "",
            motion,
            options,
        )
        for name, motion in content.items()
    ]


def is_motion(content: dict) -> bool:
    """Whether these are the fields of a motion of the robot."""
    return _field(content, "joint_pos") is not None or _robot_pose(content) is not None


def _robot_pose(motion: dict) -> np.ndarray | None:
    """`pose_aa` where it has as many bodies as the G1, (T, B, 3) [rad]."""
    pose = motion.get("pose_aa")
    if not isinstance(pose, np.ndarray) or pose.ndim != 3 or pose.shape[2] != 3 or _dof(pose.shape[1]) is None:
        return None
    return pose


def _dof(bodies: int) -> int | None:
    return next((dof for dof in sizes()[::-1] if bodies in (1 + dof, 1 + dof + _EXTENDED)), None)


def _bounded(path: Path, motions: dict) -> None:
    """Refuse more than is sensible before an array that is named a thousand times is copied a thousand times."""
    frames = seconds = 0.0
    for motion in motions.values():
        if not isinstance(motion, dict):
            continue
        longest = max((len(v) for v in motion.values() if isinstance(v, np.ndarray) and v.ndim), default=0)
        fps = _rate(motion)
        frames, seconds = frames + longest, seconds + longest / (fps if fps and 1 <= fps <= 1000 else 1000)
    if frames > _MAX_FRAMES:
        raise BadInput(path, f"at most {_MAX_FRAMES} frames in a file", "more", "Split the file.")
    if seconds > _MAX_SECONDS:
        raise BadInput(path, f"at most {_MAX_SECONDS:g} s of motion in a file", f"{seconds:.0f} s", "Split the file.")


def _motion(path: Path, name: str, part: str, motion: Any, options: RobotConfig) -> RawMotion:
    where = f"{path}, motion {part!r}" if part else str(path)
    if not isinstance(motion, dict):
        raise BadInput(where, "a dict with root_trans_offset, root_rot, dof and fps", f"a {type(motion).__name__}")
    root_pos = _matrix(where, motion, "root_pos", (3,))
    joint_pos, notes = _joint_angles(where, motion, options)
    root = _rotations(where, motion, options)
    for field, values in (("root_quat", root.quat), ("joint_pos", joint_pos)):
        if len(values) != len(root_pos):
            names = f"{_FIELDS['root_pos'][0]} and {_FIELDS[field][0]}"
            raise BadInput(where, f"as many frames in {names}", f"{len(root_pos)} and {len(values)}")
    fps = _rate(motion)
    if fps is None or not 1 <= fps <= 1000:
        came = f"{fps:g}" if fps is not None else f"a {type(motion.get('fps')).__name__}"
        raise BadInput(f"{where}, fps", "a number of frames a second from 1 to 1000", came)
    return RawMotion(
        name, fps, root_pos, root.quat, joint_pos, path, first_row=0, part=part, notes=(*notes, *root.notes),
        quat_order=root.order, order_from=root.said_by,
    )  # fmt: skip


def _joint_angles(where: str, motion: dict, options: RobotConfig) -> tuple[np.ndarray, tuple[str, ...]]:
    """Joint angles (T, 23) [rad], from `pose_aa` where there is no `dof`, and notes."""
    pose = _robot_pose(motion)
    if _field(motion, "joint_pos") is None and pose is not None:
        names, angles = _of_pose(where, pose)
        return arranged(angles, names), ("joint angles from pose_aa", *notes_of(names))
    values = _matrix(where, motion, "joint_pos", sizes()[::-1])
    names = _joint_names(where, motion, values.shape[1], options)
    return arranged(values, names), notes_of(names)


def _joint_names(where: str, motion: dict, dof: int, options: RobotConfig) -> tuple[str, ...]:
    """The joints of `dof`: by the file's names, the axes of `pose_aa`, or the settings."""
    field = next((name for name in _NAMES if motion.get(name) is not None), None)
    if field is not None:
        given = motion[field]
        names = tuple(str(name)[:60] for name in (given.reshape(-1) if isinstance(given, np.ndarray) else given)[:100])
        require_joints(f"{where}, {field}", names)
        if len(names) != dof:
            raise BadInput(f"{where}, {field}", f"{dof} names, as many as joints", str(len(names)))
        return names
    pose = _robot_pose(motion)
    if pose is not None and _dof(pose.shape[1]) == dof and np.isfinite(pose).all() and pose[:, 1:].any():
        return _of_pose(where, pose)[0]
    return layout_of(f"{where}, {' or '.join(JOINT_FIELDS)}", dof, options.joints_23)


def _of_pose(where: str, pose: np.ndarray) -> tuple[tuple[str, ...], np.ndarray]:
    """The joints about whose axes `pose_aa` turns, and their angles (T, n) [rad]."""
    pose = require_real(f"{where}, pose_aa", pose)
    axes = {joint.name: joint.axis for joint in joints(every=True)}
    found = []
    for names in layouts(_dof(pose.shape[1]) or sizes()[-1]).values():
        turned, about = pose[:, 1 : 1 + len(names)], np.array([axes[name] for name in names])
        with np.errstate(all="ignore"):  # what is no number is named by the checks of every motion
            angles = (turned * about).sum(axis=2)
            beside = float(np.abs(turned - angles[..., None] * about).max(initial=0.0))
        found.append((beside, names, angles))
    beside, names, angles = min(found, key=lambda one: one[0])
    if beside > _OFF_AXIS:
        wanted = f"rotations about the {len(names)} joint axes of the G1"
        raise BadInput(f"{where}, pose_aa", wanted, f"{beside:.3g} rad beside them", "A motion of another body?")
    return names, angles


@dataclass(frozen=True)
class _Root:
    """The root's quaternions (T, 4) [wxyz], their order in the file and who says it."""

    quat: np.ndarray
    order: str = "xyzw"
    said_by: Literal["", "file", "known"] = ""
    notes: tuple[str, ...] = ()


def _rotations(where: str, motion: dict, options: RobotConfig) -> _Root:
    """The root's rotation; `pose_aa` says the quaternions' order where there is one."""
    pose = _robot_pose(motion)
    told = None
    if pose is not None and pose.any():  # some files carry zeros instead
        with np.errstate(all="ignore"):
            told = quaternions.from_rotation_vector(require_real(f"{where}, pose_aa", pose)[:, 0])
    if _field(motion, "root_quat") is None and told is not None:
        return _Root(told, "wxyz", "known", ("root rotation from pose_aa",))
    given = _matrix(where, motion, "root_quat", (4,))
    if options.quaternion:
        return _Root(as_wxyz(given, options.quaternion), options.quaternion, "known")
    xyzw = as_wxyz(given, "xyzw")
    if told is None or len(told) != len(given):
        return _Root(xyzw)
    if _apart(xyzw, told) <= _APART:
        return _Root(xyzw, said_by="file")
    if _apart(given, told) <= _APART:
        return _Root(given, "wxyz", "file", ("root quaternions wxyz, as pose_aa tells",))
    came = f"{_apart(xyzw, told):.2f} rad apart in the median"
    which = say({"quaternion": "xyzw"}, {"quaternion": "wxyz"})
    raise BadInput(f"{where}, root_rot", "the same rotation as in pose_aa", came, f"To read root_rot alone: {which}")


def _apart(one: np.ndarray, other: np.ndarray) -> float:
    """Median angle between rotations (T, 4) [rad]; infinite where they are no numbers."""
    with np.errstate(all="ignore"):
        lengths = np.linalg.norm(one, axis=1) * np.linalg.norm(other, axis=1)
        dot = np.abs((one * other).sum(axis=1)) / lengths
        angle = float(np.median(2 * np.arccos(np.clip(dot, 0, 1)))) if len(dot) else 0.0
    return angle if np.isfinite(angle) else np.inf


def _rate(motion: dict) -> float | None:
    """The frame rate [Hz], None if it is no number."""
    fps = motion.get("fps")
    if isinstance(fps, np.ndarray) and fps.size == 1:
        fps = fps.item()
    return None if isinstance(fps, bool) or not isinstance(fps, int | float) else float(fps)


def _said(name: object) -> str:
    """A motion's name as it may stand in a line."""
    return shown(str(name), 80)


def _field(motion: dict, field: str) -> Any:
    return next((motion[name] for name in _FIELDS[field] if name in motion), None)


def _matrix(where: str, motion: dict, field: str, widths: tuple[int, ...]) -> np.ndarray:
    name = " or ".join(_FIELDS[field])
    values = _field(motion, field)
    expected = f"an array of {' or '.join(str(w) for w in widths)} columns"
    if values is None:
        present = ", ".join(_said(key) for key in list(motion)[:8])
        raise BadInput(f"{where}, {name}", expected, f"no such field among {present}"[:200])
    if not isinstance(values, np.ndarray) or values.ndim != 2 or values.shape[1] not in widths:
        came = f"shape {values.shape}" if isinstance(values, np.ndarray) else f"a {type(values).__name__}"
        raise BadInput(f"{where}, {name}", expected, came)
    return require_real(f"{where}, {name}", values)
