"""Reads ASAP's motions of the G1: joblib pickles with 23 joints, root quaternions xyzw; GMR's field names too."""

from pathlib import Path
from typing import Any

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.io.read import require_real
from bumblebee.motion.formats import safe_pickle
from bumblebee.motion.raw import RawMotion
from bumblebee.motion.texts import shown
from bumblebee.robot.facts import joint_names

# Of all motions of a file together; a pickle may name one array many times.
_MAX_FRAMES = 5_000_000
_MAX_SECONDS = 4 * 3600.0

# What we call it -> what the field calls it, ASAP's name first, then GMR's.
_FIELDS = {
    "root_pos": ("root_trans_offset", "root_pos"),
    "root_quat": ("root_rot",),
    "joint_pos": ("dof", "dof_pos"),
}


def read_asap_pickle(path: Path, data: bytes | None = None) -> list[RawMotion]:
    """All motions of one pickle: `{name: {root_trans_offset, root_rot, dof, fps}}`, or one such inner dict.

    Args:
        path: the file.
        data: its bytes, where they have been read.
    """
    content = safe_pickle.load(path, data)
    if not isinstance(content, dict) or not content:
        raise BadInput(path, "a dict of motions", f"a {type(content).__name__}")
    if _field(content, "joint_pos") is not None:
        content, named = {"": content}, False
    else:
        named = len(content) > 1
    _bounded(path, content)
    return [
        _motion(path, f"{path.stem}_{_said(name)}" if named else path.stem, _said(name) if named else "", motion)
        for name, motion in content.items()
    ]


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


def _motion(path: Path, name: str, part: str, motion: Any) -> RawMotion:
    where = f"{path}, motion {part!r}" if part else str(path)
    if not isinstance(motion, dict):
        raise BadInput(where, "a dict with root_trans_offset, root_rot, dof and fps", f"a {type(motion).__name__}")
    root_pos = _matrix(where, motion, "root_pos", (3,))
    root_quat = _matrix(where, motion, "root_quat", (4,))
    joint_pos = _matrix(where, motion, "joint_pos", (23, 29))
    for field, values in (("root_quat", root_quat), ("joint_pos", joint_pos)):
        if len(values) != len(root_pos):
            names = f"{_FIELDS['root_pos'][0]} and {_FIELDS[field][0]}"
            raise BadInput(where, f"as many frames in {names}", f"{len(root_pos)} and {len(values)}")
    fps = _rate(motion)
    if fps is None or not 1 <= fps <= 1000:
        came = f"{fps:g}" if fps is not None else f"a {type(motion.get('fps')).__name__}"
        raise BadInput(f"{where}, fps", "a number of frames a second from 1 to 1000", came)
    xyzw = root_quat[:, [3, 0, 1, 2]]
    return RawMotion(name, fps, root_pos, xyzw, actuated(joint_pos), path, first_row=0, part=part)


def _rate(motion: dict) -> float | None:
    """The frame rate [Hz], None if it is no number."""
    fps = motion.get("fps")
    if isinstance(fps, np.ndarray) and fps.size == 1:
        fps = fps.item()
    return None if isinstance(fps, bool) or not isinstance(fps, int | float) else float(fps)


def _said(name: object) -> str:
    """A motion's name as it may stand in a line."""
    return shown(str(name), 80)


def actuated(joint_pos: np.ndarray) -> np.ndarray:
    """The 23 actuated of (T, 29) joints in Unitree's order, the wrists dropped; (T, 23) stays."""
    if joint_pos.shape[1] == len(joint_names()):
        return joint_pos
    return joint_pos[:, [joint_names(29).index(name) for name in joint_names()]]


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
